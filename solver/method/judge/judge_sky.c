#include "solver/method/judge/judge_sky.h"

#include "solver/base/random.h"
#include "solver/method/judge/guided_reference.h"
#include "solver/operator/emitters.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SKIES = JUDGE_EVEN_SKIES + JUDGE_SUNS };

/* Tiles whose direct light is judged, the suns and others: at most, and as many numbers as that takes. */
enum { TILES_MOST = 24, TILE_ELEMENTS = 24 * 1024 };

/* Clouds are this bright at least, relative to the brightest. */
static const double darkest_cloud = .2;

/* Means over groups are stored up to so many numbers. */
static const size_t means_most = (size_t)1 << 20;

/* Skies [SKIES][m], of which suns are single tiles, their emissions rho H0 by one first bounce,
 * [SKIES][C][n]. */
typedef struct skies {
    size_t count;
    size_t n_tiles, tile[TILES_MOST]; /* the suns first */
    float *L;
    float
        *row[2]; /* [n_tiles][n], closer first bounces of these tiles by each sample; NULL: there are none */
    float *E[3]; /* by the operator's own, and by each sample */
    float *B;
    double *x[3]; /* by the independent reference and each sample; by the other one and the mean of both */
} skies;

static void skies_free(skies *s) {
    free(s->L);
    for (int k = 0; k < 2; k++) free(s->row[k]);
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

/* Draws a tile by weight [m], which is 0 then; m where none has any. */
static size_t draw_tile(size_t m, double *weight, uint64_t *state) {
    double all = 0;
    for (size_t t = 0; t < m; t++) all += weight[t];
    double left = random_unit(state) * all;
    for (size_t t = 0; t < m; t++) {
        if (weight[t] > 0 && left <= weight[t]) {
            weight[t] = 0;
            return t;
        }
        left -= weight[t];
    }
    return m;
}

/* Draws skies and up to n_tiles tiles; false where no tile sends any light. Suns are drawn by the root of the
 * power, as bright ones count most and dim ones err most, the other tiles evenly. weight [m], the power, is
 * used up. */
static bool draw(size_t m, size_t n_tiles, double *weight, uint64_t state, skies *s) {
    for (size_t t = 0; t < m; t++) {
        weight[t] = sqrt(weight[t]);
        s->L[t] = 1;
        s->L[m + t] = (float)(darkest_cloud + (1 - darkest_cloud) * random_unit(&state));
    }
    for (s->n_tiles = 0; s->n_tiles < n_tiles; s->n_tiles++) {
        if (s->n_tiles == JUDGE_SUNS)
            for (size_t t = 0; t < m; t++) weight[t] = weight[t] > 0;
        const size_t drawn = draw_tile(m, weight, &state);
        if (drawn == m) break;
        s->tile[s->n_tiles] = drawn;
        if (s->n_tiles < JUDGE_SUNS) s->L[(JUDGE_EVEN_SKIES + s->n_tiles) * m + drawn] = 1;
    }
    s->count = JUDGE_EVEN_SKIES + (s->n_tiles < JUDGE_SUNS ? s->n_tiles : JUDGE_SUNS);
    return s->n_tiles > 0;
}

/* E = rho H0, [count][C][n], with H0 = sum_t L_t first_bounce_t, that of suns by what is known closer. */
static void light(const judge_input *input, const float *first, const float *row, const skies *s, float *E) {
    const build_problem *p = input->problem;
    const size_t n = p->n, C = p->n_channels, m = input->sky->n_tiles;
#pragma omp parallel for schedule(static)
    for (size_t i = 0; i < n; i++)
        for (size_t v = 0; v < s->count; v++) {
            double H = 0;
            if (row != NULL && v >= JUDGE_EVEN_SKIES)
                H = (double)row[(v - JUDGE_EVEN_SKIES) * n + i];
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
    const size_t n = input->problem->n;
    light(input, sky->own, NULL, s, s->E[0]);
    for (int k = 0; k < 2; k++) {
        if (sky->tiles != NULL) {
            s->row[k] = memory_allocate(s->n_tiles, n * sizeof *s->row[k], "skies", error);
            if (s->row[k] == NULL) TRY(LAM_ERR_MEMORY);
            TRY(sky->tiles(sky->tiles_context, k, s->n_tiles, s->tile, s->row[k], error));
        }
        light(input, sky->samples[k], s->row[k], s, s->E[k + 1]);
    }
done:
    return status;
}

static void add_direct(const judge_input *input, const skies *s, sky_law_sums *law) {
    const size_t n = input->problem->n;
    for (size_t k = 0; k < s->n_tiles; k++) {
        const float *of[2];
        for (int h = 0; h < 2; h++)
            of[h] = s->row[h] != NULL ? s->row[h] + k * n : input->sky->samples[h] + s->tile[k] * n;
        sky_law_add_direct(law, s->tile[k], of[0], of[1]);
    }
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
    size_t all[SKIES];
    for (size_t v = 0; v < s->count; v++) all[v] = v;
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

static lam_status allocate(const judge_input *input, skies *s, lam_error *error) {
    const size_t vector = input->problem->n * input->problem->n_channels;
    s->L = memory_allocate(SKIES, input->sky->n_tiles * sizeof *s->L, "skies", error);
    s->B = memory_allocate(SKIES, vector * sizeof *s->B, "skies", error);
    if (s->L == NULL || s->B == NULL) return LAM_ERR_MEMORY;
    for (int k = 0; k < 3; k++)
        if ((s->E[k] = memory_allocate(SKIES, vector * sizeof *s->E[k], "skies", error)) == NULL)
            return LAM_ERR_MEMORY;
    for (int k = 0; k < 3; k++)
        if ((s->x[k] = memory_allocate(SKIES, vector * sizeof *s->x[k], "skies", error)) == NULL)
            return LAM_ERR_MEMORY;
    return LAM_OK;
}

static size_t tiles_of(size_t n) {
    const size_t tiles = TILE_ELEMENTS / n;
    return tiles < JUDGE_SUNS ? JUDGE_SUNS : tiles > TILES_MOST ? TILES_MOST : tiles;
}

lam_status judge_sky_add(const lam_operator *op, const judge_input *input, figure_group *figures,
                         by_group_sums *bins, sky_law_sums *law, size_t *done, lam_error *error) {
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
    if (!draw(m, tiles_of(p->n), weight, input->seed + 3, &s)) goto done;
    TRY(light_all(input, &s, error));
    TRY(answer(op, &s, error));
    TRY(solve(op, input, &input->independent, &s, s.E[1], s.x[0], error));
    TRY(solve(op, input, twins ? &input->other : &input->independent, &s, s.E[2], s.x[1], error));
    if (law->n_bins > 0) add_direct(input, &s, law);
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
        if (law->n_bins > 0)
            sky_law_add(law, &one, s.L + v * m, v < JUDGE_EVEN_SKIES ? input->sky->own_share : 1, bins);
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
