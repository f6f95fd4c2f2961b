/* Form factors pair by pair, of all pairs. */
#include "solver/formfactor/closing.h"
#include "solver/formfactor/glass/pane_factors.h"
#include "solver/formfactor/leaving.h"
#include "solver/formfactor/pairs/pairs.h"
#include "solver/formfactor/pairs/pairs_sample.h"
#include "solver/formfactor/pairs/pairs_twice.h"
#include "solver/formfactor/rays/rays.h"
#include "solver/formfactor/repair.h"
#include "solver/formfactor/source.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The share of each element that leaves the scene, by rays that are cast for nothing else; variance [n] or
 * NULL. */
static lam_status find_leaving(const mesh *m, const visibility *v, const uint32_t *order,
                               const form_factor_options *options, form_factors *f, double *variance,
                               lam_error *error) {
    packed_rows counts = {0};
    form_factor_options silent = *options;
    silent.progress = NULL;
    silent.scratch = NULL;
    silent.without_rows = true;
    silent.variance = variance;
    const lam_status status = rays_count(m, v, order, &silent, &counts, f->leaving, f->absorbed, error);
    packed_rows_free(&counts);
    return status;
}

/* The variance that pairs give 1 - sum_j F_ij of an element, k, by the shares r_i that rays find outside with
 * the variances v_i: E sum (p_i - r_i)^2 / v_i = n + k sum 1 / v_i. Less three standard errors of that sum,
 * so that it is 0 where rays cannot tell. */
static double variance_of_pairs(size_t n, const double *outside, const form_factors *f,
                                const double *variance) {
    double sum = 0, weights = 0;
    for (size_t i = 0; i < n; i++) {
        const double off = outside[i] - f->leaving[i] - f->absorbed[i];
        sum += off * off / variance[i];
        weights += 1 / variance[i];
    }
    return fmax(0, sum - (double)n - 3 * sqrt(2 * (double)n)) / weights;
}

/* outside_i = 1 - sum_j g_ij / A_i; with the variance of the rays' estimate of it the mean of both by inverse
 * variances. */
static void find_rests(const form_factors *f, const double *area, const double *variance, double *outside) {
    const size_t n = f->upper.n;
    for (size_t i = 0; i < n; i++)
        for (uint64_t p = f->upper.indptr[i]; p < f->upper.indptr[i + 1]; p++) {
            outside[i] += (double)f->upper.data[p];
            outside[f->upper.indices[p]] += (double)f->upper.data[p];
        }
    for (size_t i = 0; i < n; i++) outside[i] = 1 - outside[i] / area[i];
    const double of_pairs = variance != NULL ? variance_of_pairs(n, outside, f, variance) : 0;
    for (size_t i = 0; i < n; i++) {
        if (of_pairs > 0)
            outside[i] += of_pairs / (of_pairs + variance[i]) * (f->leaving[i] + f->absorbed[i] - outside[i]);
        outside[i] = fmax(0, outside[i]);
    }
}

/* Repairs the rows of all pairs; variance [n] is that of f->leaving, or NULL. */
static lam_status close_pairs(form_factors *f, const mesh *m, const visibility *v, const double *variance,
                              lam_error *error) {
    lam_status status = LAM_OK;
    double *outside = memory_allocate(m->n, sizeof *outside, "form factors", error);
    if (outside == NULL) return LAM_ERR_MEMORY;
    leaving_measure(f, m, v);
    const bool is_known = leaving_nothing(f) || leaving_by_panes(f);
    for (size_t i = 0; i < m->n && is_known; i++) outside[i] = leaving_outside(f, m, i);
    if (!is_known) find_rests(f, m->area, variance, outside);
    TRY(repair_close(&f->upper, m->area, outside, f, error));
done:
    free(outside);
    return status;
}

static lam_status make(const mesh *m, const visibility *v, const uint32_t *order,
                       const form_factor_options *options, form_factors *f, lam_error *error) {
    lam_status status = LAM_OK;
    double *variance = NULL;
    if (options->bounce != NULL) {
        variance = memory_allocate(m->n, sizeof *variance, "form factors", error);
        if (variance == NULL) return LAM_ERR_MEMORY;
    }
    TRY(find_leaving(m, v, order, options, f, variance, error));
    TRY(pairs_find(m, v, options, 0, f, &f->upper, error));
    TRY(close_pairs(f, m, v, variance, error));
done:
    free(variance);
    return status;
}

/* Rays of an element through panes for a reference: four times those of the form factors that it judges, so
 * that its own noise is a third of theirs, but of all elements together no more than a limit allows. */
static size_t reference_rays(const recipe *r, size_t n) {
    enum { FINER = 4, TOGETHER_MOST = 1 << 22 };
    const size_t own = panes_beside(r).rays;
    size_t rays = FINER * own;
    while (rays > own && rays > TOGETHER_MOST / n) rays /= 2;
    return rays;
}

lam_status form_factors_make_twice(const mesh *m, const uint32_t *order, const form_factor_options *options,
                                   uint64_t other_seed, const char *const stages[2], form_factors out[2],
                                   lam_error *error) {
    lam_status status = LAM_OK;
    visibility *v = NULL;
    form_factors f[2] = {{.recipe = options->recipe}, {.recipe = options->recipe}};
    csr G[2] = {{.n = 0}, {.n = 0}};
    pairs_options how = pairs_options_of(&options->recipe, m->n, 0);
    how.progress = options->progress;
    TRY(recipe_check(&options->recipe, error));
    for (int h = 0; h < 2; h++) {
        f[h].leaving = memory_allocate(m->n, sizeof *f[h].leaving, "form factors", error);
        f[h].absorbed = memory_allocate(m->n, sizeof *f[h].absorbed, "form factors", error);
        if (f[h].leaving == NULL || f[h].absorbed == NULL) TRY(LAM_ERR_MEMORY);
    }
    TRY(visibility_create(m, &v, error));
    TRY(find_leaving(m, v, order, options, &f[0], NULL, error));
    memcpy(f[1].leaving, f[0].leaving, m->n * sizeof *f[0].leaving);
    memcpy(f[1].absorbed, f[0].absorbed, m->n * sizeof *f[0].absorbed);
    TRY(pairs_exchange_twice(m, v, &how, other_seed, stages, G, &f[0].pairs, error));
    for (int h = 0; h < 2; h++) {
        f[h].upper = G[h];
        G[h] = (csr){.n = 0};
        TRY(close_pairs(&f[h], m, v, NULL, error));
        /* As pairs: the mean of two samples, and the same with half their difference. */
        const pane_samples through = {.rays = reference_rays(&options->recipe, m->n),
                                      .n_seeds = h == 0 ? 2 : 1,
                                      .seeds = {options->recipe.seed, other_seed}};
        TRY(panes_add(m, v, order, options, &through, &f[h], error));
        TRY(form_factors_expand(&f[h], m->area, error));
    }
    for (int h = 0; h < 2; h++) {
        out[h] = f[h];
        f[h] = (form_factors){.row_sums = NULL};
    }
done:
    visibility_destroy(v);
    for (int h = 0; h < 2; h++) {
        csr_free(&G[h]);
        form_factors_free(&f[h]);
    }
    return status;
}

static void describe(const recipe *r, char text[64]) {
    snprintf(text, 64, "pair by pair to %g", r->accuracy);
}

static void option(const recipe *r, char text[40]) {
    (void)r;
    snprintf(text, 40, "pairs");
}

/* Next to none: 1e-8 to 8e-5 in the ten generated scenes. */
static double repair(const recipe *r) {
    (void)r;
    return 0;
}

/* Few rays: the judge has no sky. */
static recipe judge(const recipe *r, size_t rays) {
    recipe few = *r;
    (void)rays;
    if (few.rays > RAYS_BESIDE_PAIRS) few.rays = RAYS_BESIDE_PAIRS;
    return few;
}

static double rays_of(double n, const recipe *r) {
    (void)r;
    return n;
}

static double bytes(double n, const recipe *r) {
    return rows_bytes(n, rays_of(n, r));
}

/* As found, and as seen. */
static double packed_bytes(double n, const recipe *r) {
    (void)r;
    return 2 * 4.5 * n * n;
}

/* The triangle with the state of each pair, and the triangle of factors. */
static double making_bytes(double n, const recipe *r, factor_place place) {
    (void)place;
    return fmax(bytes(n, r), 9 * n * n);
}

static double stored_bytes(double n, const recipe *r) {
    return rows_stored_bytes(n, bytes(n, r));
}

static double seconds(double n, const recipe *r, double entries, double ray_seconds, double slowness) {
    static const double pair_seconds = 4e-7;
    (void)r, (void)entries, (void)ray_seconds;
    return n * n / 2 * pair_seconds * slowness;
}

static lam_status sample(const factor_work *w, const recipe *r, factor_cost *out, lam_error *error) {
    return pairs_cost(w->m, r, 0, w->progress, out, error);
}

static bool less(recipe *r) {
    *r = (recipe){.source = &source_rays, .rays = RECIPE_RAYS_MOST};
    return true;
}

static void finer(recipe *r, double error, double wanted, const factor_knobs *knobs) {
    static const double power_of_accuracy = .65;
    if (knobs->accuracy && r->accuracy > knobs->finest)
        r->accuracy = fmax(r->accuracy * source_turn(error, wanted, power_of_accuracy), knobs->finest);
}

static void advise(const recipe *r, double error, double most, bool finest, char option_text[64]) {
    (void)r, (void)error, (void)most;
    snprintf(option_text, 64, finest ? "a finer mesh" : "--quality high");
}

const factor_source source_pairs = {
    .name = "pairs",
    .flags = SOURCE_ROWS | SOURCE_TWICE | SOURCE_ACCURACY | SOURCE_COARSER,
    .describe = describe,
    .option = option,
    .repair = repair,
    .judge = judge,
    .rays = rays_of,
    .bytes = bytes,
    .packed_bytes = packed_bytes,
    .making_bytes = making_bytes,
    .stored_bytes = stored_bytes,
    .seconds = seconds,
    .sample = sample,
    .make = make,
    .less = less,
    .finer = finer,
    .advise = advise,
};
