#include "solver/method/judge/judge_emitters.h"

#include "solver/method/judge/judge_black.h"
#include "solver/method/judge/judge_lit.h"
#include "solver/method/judge/judge_sky.h"
#include "solver/operator/emitters.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Probes in one go. */
enum { AT_ONCE = 8 };

/* A sky that sends less than this share of what a tile of its radiance sends on average, by the samples, is
 * all but hidden: what it is off by is no light, and its ratio to what there is is nothing but noise. */
static const double hidden = .01;

bool judge_emitters_are_lit(const lam_operator *op, const judge_input *input) {
    return lam_operator_emitters(op) > 0 && input->sky != NULL && judge_sky_is_asked(op);
}

/* Some probes, first ... first + count - 1. */
typedef struct some_probes {
    const judge_input *input;
    const probes *p;
    size_t first;
    float *L;             /* [AT_ONCE][C][m] */
    float *near[2];       /* [AT_ONCE][n], closer first bounces of single tiles, by each sample */
    size_t tile[AT_ONCE]; /* those tiles */
    const float *row[2][AT_ONCE];
    lit_probes lit;
} some_probes;

static void some_free(some_probes *s) {
    free(s->L);
    for (int h = 0; h < 2; h++) free(s->near[h]);
    lit_probes_free(&s->lit);
}

static lam_status some_make(const judge_input *input, const probes *p, some_probes *s, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = input->problem->n, C = input->problem->n_channels;
    *s = (some_probes){.input = input, .p = p};
    s->L = memory_allocate(AT_ONCE * C, input->sky->n_tiles * sizeof *s->L, "skies", error);
    if (s->L == NULL) return LAM_ERR_MEMORY;
    for (int h = 0; h < 2 && input->sky->tiles != NULL; h++) {
        s->near[h] = memory_allocate(AT_ONCE, n * sizeof *s->near[h], "skies", error);
        if (s->near[h] == NULL) return LAM_ERR_MEMORY;
    }
    TRY(lit_probes_make(input, AT_ONCE, &s->lit, error));
done:
    return status;
}

/* The tile that alone is bright in L [C][m]; m: there is none. */
static size_t single_tile(size_t n_channels, size_t m, const float *L) {
    size_t found = m;
    for (size_t k = 0; k < n_channels * m; k++) {
        if (L[k] == 0 || k % m == found) continue;
        if (found < m) return m;
        found = k % m;
    }
    return found;
}

/* The first bounces of single tiles, up to `most` of them. */
static lam_status find_rows(some_probes *s, size_t *most, lam_error *error) {
    lam_status status = LAM_OK;
    const judged_sky *sky = s->input->sky;
    const size_t n = s->input->problem->n, C = s->input->problem->n_channels, m = sky->n_tiles;
    size_t count = 0, of[AT_ONCE];
    for (size_t v = 0; v < s->lit.count; v++) {
        const size_t tile = single_tile(C, m, s->L + v * C * m);
        s->row[0][v] = s->row[1][v] = NULL;
        if (sky->tiles == NULL || tile == m || count == *most) continue;
        of[count] = v;
        s->tile[count++] = tile;
    }
    for (int h = 0; h < 2 && count > 0; h++) {
        TRY(sky->tiles(sky->tiles_context, h, count, s->tile, s->near[h], error));
        for (size_t k = 0; k < count; k++) s->row[h][of[k]] = s->near[h] + k * n;
    }
    *most -= count;
done:
    return status;
}

/* Sets the emission of elements, the light of the sky by both samples, and the answers. */
static lam_status light(const lam_operator *op, some_probes *s, size_t *most, lam_error *error) {
    lam_status status = LAM_OK;
    const build_problem *problem = s->input->problem;
    const size_t n = problem->n, C = problem->n_channels, vector = n * C, before = s->first * vector;
    const size_t all = s->lit.count * vector;
    operator_emitters_radiances(op, s->lit.count, s->p->W + s->first * C * lam_operator_emitters(op), s->L);
    TRY(find_rows(s, most, error));
    for (size_t k = 0; k < all; k++) {
        const float own = problem->reflectance[k % vector] * s->p->H0[before + k];
        for (int h = 0; h < 3; h++) s->lit.E[h][k] = s->p->E[before + k] - own;
    }
    memcpy(s->lit.B, s->p->B + before, all * sizeof *s->lit.B);
    const float *const *row[2] = {s->row[0], s->row[1]};
    lit_probes_light_all(s->input, s->L, row, &s->lit);
done:
    return status;
}

/* The light that a tile of radiance 1 gives to elements that reflect it, or that are judged by it, on
 * average.
 */
static double light_of_tile(const judge_input *input) {
    const build_problem *p = input->problem;
    const size_t n = p->n, m = input->sky->n_tiles;
    double sum = 0;
    for (size_t i = 0; i < n; i++) {
        double seen = 0, rho = 0;
        for (size_t t = 0; t < m; t++) seen += (double)input->sky->own[t * n + i];
        for (size_t c = 0; c < p->n_channels; c++) rho += judge_reflectance(input, c, i);
        sum += p->area[i] * rho * seen;
    }
    return sum / (double)m;
}

/* True where probe v is hidden: of E and direct by both samples, which lit_probes_solve made their mean. */
static bool is_hidden(const some_probes *s, size_t v, double of_tile) {
    const judge_input *input = s->input;
    const size_t n = input->problem->n, vector = n * input->problem->n_channels;
    const size_t all = input->problem->n_channels * input->sky->n_tiles;
    double light = 0, brightest = 0;
    for (size_t k = 0; k < vector; k++) {
        light += input->problem->area[k % n] * (double)s->lit.E[1][v * vector + k];
        if (judge_is_black(input, k % n))
            light += input->problem->area[k % n] * (double)s->lit.direct[1][v * vector + k];
    }
    for (size_t k = 0; k < all; k++) brightest = fmax(brightest, (double)s->L[v * all + k]);
    return light < hidden * brightest * of_tile;
}

lam_status judge_emitters_add(const lam_operator *op, const probes *p, judge_rounds *r, lam_error *error) {
    lam_status status = LAM_OK;
    some_probes s = {.first = 0};
    const double of_tile = light_of_tile(r->input);
    if (r->n == 0) r->tiles_left = judge_sky_tiles(r->input->problem->n);
    TRY(some_make(r->input, p, &s, error));
    for (; s.first < p->m; s.first += AT_ONCE) {
        s.lit.count = p->m - s.first < AT_ONCE ? p->m - s.first : AT_ONCE;
        TRY(light(op, &s, &r->tiles_left, error));
        TRY(lit_probes_solve(op, r->input, &s.lit, error));
        for (size_t v = 0; v < s.lit.count; v++) {
            const figure_probe one = lit_probes_at(r->input, &s.lit, v);
            if (is_hidden(&s, v, of_tile)) continue;
            int group = 0;
            while (p->begin[group + 1] <= s.first + v) group++;
            judge_rounds_add_total(r, group, &one);
        }
    }
done:
    some_free(&s);
    return status;
}
