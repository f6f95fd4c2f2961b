#include "solver/method/judge/judge_sky.h"

#include "solver/base/random.h"
#include "solver/method/judge/judge_black.h"
#include "solver/method/judge/judge_lit.h"
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

/* Skies [SKIES][m], of which suns are single tiles. */
typedef struct skies {
    size_t count;
    size_t n_tiles, tile[TILES_MOST]; /* the suns first */
    float *L;
    float
        *row[2]; /* [n_tiles][n], closer first bounces of these tiles by each sample; NULL: there are none */
    lit_probes lit;
} skies;

static void skies_free(skies *s) {
    free(s->L);
    for (int k = 0; k < 2; k++) free(s->row[k]);
    lit_probes_free(&s->lit);
}

/* power [C][m]: sum A rho first_bounce of each tile, rho being 1 where nothing reflects. */
static void find_powers(const judge_input *input, double *power) {
    const build_problem *p = input->problem;
    const size_t n = p->n, m = input->sky->n_tiles;
#pragma omp parallel for schedule(static, 4)
    for (size_t t = 0; t < m; t++)
        for (size_t c = 0; c < p->n_channels; c++) {
            const float *first = input->sky->own + t * n;
            double sum = 0;
            for (size_t i = 0; i < n; i++)
                sum += p->area[i] * judge_power_share(input, c, i) * (double)first[i];
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

/* Single tiles closer, by each sample, where these are known. */
static lam_status find_rows(const judge_input *input, skies *s, lam_error *error) {
    lam_status status = LAM_OK;
    const judged_sky *sky = input->sky;
    for (int k = 0; k < 2 && sky->tiles != NULL; k++) {
        s->row[k] = memory_allocate(s->n_tiles, input->problem->n * sizeof *s->row[k], "skies", error);
        if (s->row[k] == NULL) TRY(LAM_ERR_MEMORY);
        TRY(sky->tiles(sky->tiles_context, k, s->n_tiles, s->tile, s->row[k], error));
    }
done:
    return status;
}

/* All skies, the same in all channels: suns by what is known closer of them. */
static lam_status light_all(const judge_input *input, skies *s, lam_error *error) {
    const size_t n = input->problem->n, C = input->problem->n_channels, m = input->sky->n_tiles;
    const float *rows[2][SKIES] = {{NULL}};
    const float *const *of[2] = {rows[0], rows[1]};
    float *L = memory_allocate(s->count, C * m * sizeof *L, "skies", error);
    if (L == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < s->count * C; k++) memcpy(L + k * m, s->L + k / C * m, m * sizeof *L);
    for (size_t v = JUDGE_EVEN_SKIES; v < s->count; v++)
        for (int h = 0; h < 2; h++)
            rows[h][v] = s->row[h] != NULL ? s->row[h] + (v - JUDGE_EVEN_SKIES) * n : NULL;
    s->lit.count = s->count;
    lit_probes_light_all(input, L, of, &s->lit);
    free(L);
    return LAM_OK;
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

/* The operator's answers, and its irradiance of black elements: the direct light and H of emission rho H0. */
static lam_status answer(const lam_operator *op, const judge_input *input, skies *s, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = input->problem->n, all = s->count * input->problem->n_channels * n;
    const size_t bytes = lam_operator_work_bytes(op, s->count);
    float *H = NULL;
    void *work = NULL;
    if (lam_operator_emitters(op) > 0) return lit_probes_answer(op, input, &s->lit, error);
    work = memory_allocate(bytes, 1, "the work area of a solve", error);
    if (work == NULL) TRY(LAM_ERR_MEMORY);
    TRY(lam_operator_apply(op, s->count, LAM_RADIOSITY, s->lit.E[0], s->lit.B, work, bytes, error));
    if (input->black == NULL) goto done;
    H = memory_allocate(all, sizeof *H, "skies", error);
    if (H == NULL) TRY(LAM_ERR_MEMORY);
    TRY(lam_operator_apply(op, s->count, LAM_IRRADIANCE, s->lit.E[0], H, work, bytes, error));
    for (size_t k = 0; k < all; k++)
        if (input->black[k % n]) s->lit.B[k] = H[k] + s->lit.direct[0][k];
done:
    free(H);
    free(work);
    return status;
}

size_t judge_sky_tiles(size_t n) {
    const size_t tiles = TILE_ELEMENTS / n;
    return tiles < JUDGE_SUNS ? JUDGE_SUNS : tiles > TILES_MOST ? TILES_MOST : tiles;
}

bool judge_sky_is_asked(const lam_operator *op) {
    const emitters *few = operator_emitters_of(op);
    return few == NULL || few->a.L != NULL;
}

lam_status judge_sky_add(const lam_operator *op, const judge_input *input, figure_group *figures,
                         by_group_sums *bins, sky_law_sums *law, size_t *done, lam_error *error) {
    lam_status status = LAM_OK;
    const build_problem *p = input->problem;
    const size_t m = input->sky->n_tiles;
    skies s = {.count = 0};
    double *power = NULL, *weight = NULL;
    if (input->independent.n == 0 || !judge_sky_is_asked(op)) return LAM_OK;
    power = memory_allocate(m, p->n_channels * sizeof *power, "skies", error);
    weight = memory_allocate(m, sizeof *weight, "skies", error);
    s.L = memory_allocate(SKIES, m * sizeof *s.L, "skies", error);
    if (power == NULL || weight == NULL || s.L == NULL) TRY(LAM_ERR_MEMORY);
    TRY(lit_probes_make(input, SKIES, &s.lit, error));
    find_powers(input, power);
    for (size_t k = 0; k < m * p->n_channels; k++) weight[k % m] += power[k];
    if (!draw(m, judge_sky_tiles(p->n), weight, input->seed + 3, &s)) goto done;
    TRY(find_rows(input, &s, error));
    TRY(light_all(input, &s, error));
    TRY(answer(op, input, &s, error));
    if (law->n_bins > 0) add_direct(input, &s, law);
    TRY(lit_probes_solve(op, input, &s.lit, error));
    for (size_t v = 0; v < s.count; v++) {
        const figure_probe one = lit_probes_at(input, &s.lit, v);
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
