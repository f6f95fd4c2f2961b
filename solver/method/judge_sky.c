#include "solver/method/judge_sky.h"

#include "solver/base/random.h"
#include "solver/method/guided_reference.h"
#include "solver/operator/emitters.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SKIES = JUDGE_EVEN_SKIES + JUDGE_SUNS };

/* Clouds are this bright at least, relative to the brightest. */
static const double darkest_cloud = .2;

/* Means over groups are stored up to so many numbers. */
static const size_t means_most = (size_t)1 << 20;

/* Skies [SKIES][m], of which suns are single tiles, their emissions rho H0 by one first bounce,
 * [SKIES][C][n]. */
typedef struct skies {
    size_t count;
    size_t tile[JUDGE_SUNS];
    float *L;
    float *sun;  /* [JUDGE_SUNS][n], a closer first bounce of these tiles */
    float *E[3]; /* by the operator's own, and by each sample */
    float *B;
    double *x[3]; /* by the independent reference and each sample; by the other one and the mean of both */
} skies;

static void skies_free(skies *s) {
    free(s->L);
    free(s->sun);
    for (int k = 0; k < 3; k++) free(s->E[k]);
    free(s->B);
    for (int k = 0; k < 3; k++) free(s->x[k]);
}

/* power [C][m]: sum A rho first_bounce of each tile. */
static void find_powers(const judge_input *input, double *power) {
    const build_problem *p = input->problem;
    const size_t n = p->n, m = input->sky->n_tiles;
#pragma omp parallel for schedule(static, 4)
    for (size_t t = 0; t < m; t++)
        for (size_t c = 0; c < p->n_channels; c++) {
            const float *first = input->sky->own + t * n;
            double sum = 0;
            for (size_t i = 0; i < n; i++)
                sum += p->area[i] * (double)p->reflectance[c * n + i] * (double)first[i];
            power[c * m + t] = sum;
        }
}

/* Draws skies; false where no tile sends any light. weight [m] is used up. */
static bool draw(size_t m, double *weight, uint64_t state, skies *s) {
    for (size_t t = 0; t < m; t++) {
        s->L[t] = 1;
        s->L[m + t] = (float)(darkest_cloud + (1 - darkest_cloud) * random_unit(&state));
    }
    for (s->count = JUDGE_EVEN_SKIES; s->count < SKIES; s->count++) {
        double all = 0;
        size_t drawn = m;
        for (size_t t = 0; t < m; t++) all += weight[t];
        double left = random_unit(&state) * all;
        for (size_t t = 0; t < m && drawn == m; t++) {
            if (weight[t] > 0 && left <= weight[t]) drawn = t;
            left -= weight[t];
        }
        if (drawn == m) break;
        s->L[s->count * m + drawn] = 1;
        s->tile[s->count - JUDGE_EVEN_SKIES] = drawn;
        weight[drawn] = 0;
    }
    return s->count > JUDGE_EVEN_SKIES;
}

/* E = rho H0, [count][C][n], with H0 = sum_t L_t first_bounce_t, that of suns by what is known closer. */
static void light(const judge_input *input, const float *first, bool closer, const skies *s, float *E) {
    const build_problem *p = input->problem;
    const size_t n = p->n, C = p->n_channels, m = input->sky->n_tiles;
#pragma omp parallel for schedule(static)
    for (size_t i = 0; i < n; i++)
        for (size_t v = 0; v < s->count; v++) {
            double H = 0;
            if (closer && v >= JUDGE_EVEN_SKIES)
                H = (double)s->sun[(v - JUDGE_EVEN_SKIES) * n + i];
            else
                for (size_t t = 0; t < m; t++) H += (double)s->L[v * m + t] * (double)first[t * n + i];
            for (size_t c = 0; c < C; c++)
                E[(v * C + c) * n + i] = (float)(H * (double)p->reflectance[c * n + i]);
        }
}

/* E[k] of the operator's first bounce, k = 0, and of the samples, 1 and 2. */
static lam_status light_all(const judge_input *input, skies *s, lam_error *error) {
    lam_status status = LAM_OK;
    const judged_sky *sky = input->sky;
    const bool closer = sky->tiles != NULL;
    light(input, sky->own, false, s, s->E[0]);
    for (int k = 0; k < 2; k++) {
        if (closer)
            TRY(sky->tiles(sky->tiles_context, k, s->count - JUDGE_EVEN_SKIES, s->tile, s->sun, error));
        light(input, sky->samples[k], closer, s, s->E[k + 1]);
    }
done:
    return status;
}

typedef struct corrections {
    size_t n, n_channels;
    double *x;
} corrections;

static void keep(void *context, size_t v, size_t channel, const double *x) {
    const corrections *to = context;
    memcpy(to->x + (v * to->n_channels + channel) * to->n, x, to->n * sizeof *x);
}

/* x [count][C][n]: corrections of the answers to the emissions E, by F. */
static lam_status solve(const lam_operator *op, const judge_input *input, const factor_product *F,
                        const skies *s, const float *E, double *x, lam_error *error) {
    const build_problem *p = input->problem;
    const reference_system system = {p->n, p->n_channels, F, p->area, p->reflectance};
    const reference_answers answers = {.op = op, .E = E, .B = s->B, .progress = input->progress};
    const size_t all[SKIES] = {0, 1, 2, 3, 4, 5};
    corrections to = {p->n, p->n_channels, x};
    return guided_reference_each(&system, &answers, s->count, all, keep, &to, error);
}

static lam_status answer(const lam_operator *op, const skies *s, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t bytes = lam_operator_work_bytes(op, s->count);
    void *work = memory_allocate(bytes, 1, "the work area of a solve", error);
    if (work == NULL) return LAM_ERR_MEMORY;
    TRY(lam_operator_apply(op, s->count, LAM_RADIOSITY, s->E[0], s->B, work, bytes, error));
done:
    free(work);
    return status;
}

/* The effective number of tiles of sky v. */
static double number_of(const judge_input *input, const skies *s, const double *power, size_t v) {
    const size_t m = input->sky->n_tiles, C = input->problem->n_channels;
    double whole = 0, squares = 0;
    for (size_t c = 0; c < C; c++) {
        double sum = 0;
        for (size_t t = 0; t < m; t++) {
            const double part = (double)s->L[v * m + t] * power[c * m + t];
            sum += part;
            squares += part * part;
        }
        whole += sum * sum;
    }
    return squares > 0 ? whole / squares : 0;
}

static lam_status allocate(const judge_input *input, skies *s, lam_error *error) {
    const size_t vector = input->problem->n * input->problem->n_channels;
    s->L = memory_allocate(SKIES, input->sky->n_tiles * sizeof *s->L, "skies", error);
    s->B = memory_allocate(SKIES, vector * sizeof *s->B, "skies", error);
    s->sun = memory_allocate(JUDGE_SUNS, input->problem->n * sizeof *s->sun, "skies", error);
    if (s->L == NULL || s->B == NULL || s->sun == NULL) return LAM_ERR_MEMORY;
    for (int k = 0; k < 3; k++)
        if ((s->E[k] = memory_allocate(SKIES, vector * sizeof *s->E[k], "skies", error)) == NULL)
            return LAM_ERR_MEMORY;
    for (int k = 0; k < 3; k++)
        if ((s->x[k] = memory_allocate(SKIES, vector * sizeof *s->x[k], "skies", error)) == NULL)
            return LAM_ERR_MEMORY;
    return LAM_OK;
}

lam_status judge_sky_add(const lam_operator *op, const judge_input *input, figure_group *figures,
                         by_group_sums *sums, size_t *done, lam_error *error) {
    lam_status status = LAM_OK;
    const build_problem *p = input->problem;
    const size_t m = input->sky->n_tiles, vector = p->n * p->n_channels;
    const bool twins = input->relation == REFERENCE_TWIN && input->other.n > 0;
    const bool apart = input->other.n > 0 && !twins;
    skies s = {.count = 0};
    double *power = NULL, *weight = NULL;
    if (lam_operator_emitters(op) > 0 || input->independent.n == 0) return LAM_OK;
    power = memory_allocate(m, p->n_channels * sizeof *power, "skies", error);
    weight = memory_allocate(m, sizeof *weight, "skies", error);
    if (power == NULL || weight == NULL) TRY(LAM_ERR_MEMORY);
    TRY(allocate(input, &s, error));
    find_powers(input, power);
    for (size_t k = 0; k < m * p->n_channels; k++) weight[k % m] += power[k];
    if (!draw(m, weight, input->seed + 3, &s)) goto done;
    TRY(light_all(input, &s, error));
    TRY(answer(op, &s, error));
    TRY(solve(op, input, &input->independent, &s, s.E[1], s.x[0], error));
    TRY(solve(op, input, twins ? &input->other : &input->independent, &s, s.E[2], s.x[1], error));
    for (size_t k = 0; k < s.count * vector; k++) s.E[1][k] = .5f * (s.E[1][k] + s.E[2][k]);
    if (apart) {
        TRY(solve(op, input, &input->other, &s, s.E[1], s.x[2], error));
        for (size_t k = 0; k < s.count * vector; k++) {
            const double x = s.x[0][k], y = s.x[1][k];
            s.x[0][k] = .5 * (x + y);
            s.x[1][k] = .5 * (x - y);
        }
    }
    for (size_t v = 0; v < s.count; v++) {
        const figure_probe one = {.problem = p,
                                  .E = s.E[1] + v * vector,
                                  .B = s.B + v * vector,
                                  .x = s.x[0] + v * vector,
                                  .y = s.x[apart ? 2 : 1] + v * vector,
                                  .noise = apart ? s.x[1] + v * vector : NULL,
                                  .relation = apart ? input->relation : REFERENCE_TWIN,
                                  .other_share = input->other_share};
        figures_add(&one, figures);
        if (sums->n > 0)
            by_group_add(&one, v < JUDGE_EVEN_SKIES ? JUDGE_WHOLE : JUDGE_SINGLE,
                         number_of(input, &s, power, v), sums);
    }
    *done = s.count;
done:
    skies_free(&s);
    free(power);
    free(weight);
    return status;
}

lam_status judge_sky_powers(const judge_input *input, group_errors *out, lam_error *error) {
    lam_status status = LAM_OK;
    const build_problem *p = input->problem;
    const size_t m = input->sky->n_tiles, n = p->n;
    double *area = NULL;
    out->n_channels = p->n_channels;
    out->n_tiles = m;
    out->sky_power = memory_allocate(m, p->n_channels * sizeof *out->sky_power, "skies", error);
    if (out->sky_power == NULL) TRY(LAM_ERR_MEMORY);
    find_powers(input, out->sky_power);
    if (input->n_groups > means_most / m) goto done;
    area = memory_allocate(input->n_groups, sizeof *area, "skies", error);
    out->sky_first = memory_allocate(input->n_groups, m * sizeof *out->sky_first, "skies", error);
    if (area == NULL || out->sky_first == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) area[input->group[i]] += p->area[i];
    for (size_t t = 0; t < m; t++)
        for (size_t i = 0; i < n; i++)
            if (area[input->group[i]] > 0)
                out->sky_first[input->group[i] * m + t] +=
                    p->area[i] * (double)input->sky->own[t * n + i] / area[input->group[i]];
done:
    free(area);
    return status;
}
