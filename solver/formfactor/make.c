/* Makes form factors by rays, hemicubes, pairs or near pairs; make_blocks.c makes them by blocks. These two
 * alone know all sub-rooms. */
#include "solver/formfactor/formfactor.h"

#include "solver/base/clock.h"
#include "solver/formfactor/leaving.h"
#include "solver/formfactor/pairs/pairs.h"
#include "solver/formfactor/pairs/pairs_twice.h"
#include "solver/formfactor/rays/hemicube.h"
#include "solver/formfactor/rays/rays.h"
#include "solver/formfactor/repair.h"
#include "solver/formfactor/rows/upper.h"
#include "solver/linalg/csr.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Repairs exchange areas with the shares of the rays that leave. */
static lam_status close_upper(form_factors *f, const mesh *m, const visibility *v, lam_error *error) {
    double *outside = memory_allocate(m->n, sizeof *outside, "form factors", error);
    if (outside == NULL) return LAM_ERR_MEMORY;
    leaving_measure(f, m, v);
    for (size_t i = 0; i < m->n; i++) outside[i] = leaving_outside(f, i);
    const lam_status status = repair_close(&f->upper, m->area, outside, f, error);
    free(outside);
    return status;
}

/* Merges one-sided rows, whose entries are F_ij times rays, into the repaired upper triangle; frees the rows.
 */
static lam_status merge_and_repair(form_factors *f, const mesh *m, const visibility *v, packed_rows *rows,
                                   size_t rays, const large_place *place, lam_error *error) {
    lam_status status = LAM_OK;
    f->rows_kept = rows->kept;
    TRY(upper_merge(rows, rays, m->area, place, &f->upper, error));
    packed_rows_free(rows);
    TRY(close_upper(f, m, v, error));
done:
    return status;
}

static lam_status make_by_rays(const mesh *m, const visibility *v, const uint32_t *order,
                               const form_factor_options *options, form_factors *f, lam_error *error) {
    lam_status status = LAM_OK;
    packed_rows counts = {0};
    TRY(rays_count(m, v, order, options, &counts, f->leaving, f->absorbed, error));
    TRY(merge_and_repair(f, m, v, &counts, options->recipe.rays, options->large, error));
done:
    packed_rows_free(&counts);
    return status;
}

static lam_status make_by_hemicubes(const mesh *m, const visibility *v, const uint32_t *order,
                                    const form_factor_options *options, form_factors *f, lam_error *error) {
    lam_status status = LAM_OK;
    hemicube h = {0};
    packed_rows rows = {0};
    TRY(hemicube_create(options->recipe.resolution, &h, error));
    TRY(hemicube_trace(&h, m, v, order, options, &rows, f->leaving, f->absorbed, error));
    /* The weights are form factors already, as if one ray had been cast. */
    TRY(merge_and_repair(f, m, v, &rows, 1, options->large, error));
done:
    hemicube_free(&h);
    packed_rows_free(&rows);
    return status;
}

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
    if (!leaving_nothing(f)) find_rests(f, m->area, variance, outside);
    TRY(repair_close(&f->upper, m->area, outside, f, error));
done:
    free(outside);
    return status;
}

static lam_status make_by_pairs(const mesh *m, const visibility *v, const uint32_t *order,
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

static lam_status make_by_near_pairs(const mesh *m, const visibility *v, const uint32_t *order,
                                     const form_factor_options *options, form_factors *f, lam_error *error) {
    lam_status status = LAM_OK;
    packed_rows counts = {0};
    csr near = {0}, counted = {0};
    TRY(pairs_find(m, v, options, recipe_near(&options->recipe), f, &near, error));
    TRY(rays_count(m, v, order, options, &counts, f->leaving, f->absorbed, error));
    if (counts.kept > f->rows_kept) f->rows_kept = counts.kept;
    TRY(upper_merge(&counts, options->recipe.rays, m->area, options->large, &counted, error));
    packed_rows_free(&counts);
    TRY(csr_replace(&counted, &near, &f->upper, error));
    csr_free(&near);
    csr_free(&counted);
    TRY(close_upper(f, m, v, error));
done:
    packed_rows_free(&counts);
    csr_free(&near);
    csr_free(&counted);
    return status;
}

lam_status form_factors_make(const mesh *m, const uint32_t *order, const form_factor_options *asked,
                             form_factors *out, lam_error *error) {
    lam_status status = LAM_OK;
    visibility *v = NULL;
    form_factor_options own = *asked;
    const form_factor_options *const options = &own;
    form_factors f = {.recipe = options->recipe};
    TRY(recipe_check(&options->recipe, error));
    f.leaving = memory_allocate(m->n, sizeof *f.leaving, "form factors", error);
    f.absorbed = memory_allocate(m->n, sizeof *f.absorbed, "form factors", error);
    if (f.leaving == NULL || f.absorbed == NULL) TRY(LAM_ERR_MEMORY);
    if (asked->sky != NULL)
        TRY(sky_bounce_create(asked->sky, m->up, asked->ground_albedo, m->n, &f.sky, error));
    own.bounce = asked->sky != NULL ? &f.sky : NULL;
    own.n_aimed = &f.n_aimed;
    TRY(visibility_create(m, &v, error));
    switch (options->recipe.method) {
    case RECIPE_RAYS:
        TRY(make_by_rays(m, v, order, options, &f, error));
        break;
    case RECIPE_HEMICUBE:
        TRY(make_by_hemicubes(m, v, order, options, &f, error));
        break;
    case RECIPE_PAIRS:
        TRY(make_by_pairs(m, v, order, options, &f, error));
        break;
    case RECIPE_NEAR_PAIRS:
        TRY(make_by_near_pairs(m, v, order, options, &f, error));
        break;
    case RECIPE_BLOCKS:
        FAIL(error, LAM_ERR_ARGUMENT, "blocks of form factors are no rows; give another --form-factors");
    }
    if (asked->sky != NULL) TRY(leaving_to_sky(&f, m->n, error));
    if (!options->upper) TRY(form_factors_expand(&f, m->area, error));
    *out = f;
    f = (form_factors){0};
done:
    visibility_destroy(v);
    form_factors_free(&f);
    return status;
}

lam_status form_factors_try_rays(const mesh *m, const uint32_t *order, ray_trial *out, lam_error *error) {
    enum { ELEMENTS = 256, RAYS = 512, LONG_ENOUGH = 32 };
    static const double trial_seconds = .04;
    lam_status status = LAM_OK;
    visibility *v = NULL;
    TRY(visibility_create(m, &v, error));
    rays_cast_some(m, v, order, ELEMENTS, VISIBILITY_PACKET); /* starts threads and fills caches */
    const double started = clock_seconds(), used = clock_processor_seconds();
    *out = (ray_trial){.rays = 0};
    for (int k = 0; k < LONG_ENOUGH && out->seconds < trial_seconds; k++) {
        rays_cast_some(m, v, order, ELEMENTS, RAYS);
        out->rays += ELEMENTS * RAYS;
        out->seconds = fmax(clock_seconds() - started, 1e-6);
    }
    out->processor_seconds = fmax(clock_processor_seconds() - used, 1e-6);
done:
    visibility_destroy(v);
    return status;
}

/* The rows of some elements before the two estimates of a pair are merged, freed by packed_rows_free. */
static lam_status find_some(const mesh *m, const recipe *how, const uint32_t *elements, size_t count,
                            const progress *steps, const char *stage, packed_rows *rows, lam_error *error) {
    lam_status status = LAM_OK;
    visibility *v = NULL;
    hemicube h = {0};
    double *outside = memory_allocate(m->n, 2 * sizeof *outside, "rows of form factors", error);
    if (outside == NULL) return LAM_ERR_MEMORY;
    const form_factor_options options = {
        .recipe = *how, .progress = steps, .stage = stage, .only_first = count};
    if (how->method != RECIPE_RAYS && how->method != RECIPE_HEMICUBE)
        FAIL(error, LAM_ERR_ARGUMENT, "elements seen: must be counted by rays or by hemicubes");
    if (count < 1 || count > m->n)
        FAIL(error, LAM_ERR_ARGUMENT, "elements seen: by %zu of %zu elements; must be by 1 to all", count,
             m->n);
    TRY(visibility_create(m, &v, error));
    if (how->method == RECIPE_HEMICUBE) {
        TRY(hemicube_create(how->resolution, &h, error));
        TRY(hemicube_trace(&h, m, v, elements, &options, rows, outside, outside + m->n, error));
    } else {
        TRY(rays_count(m, v, elements, &options, rows, outside, outside + m->n, error));
    }
done:
    free(outside);
    hemicube_free(&h);
    visibility_destroy(v);
    return status;
}

lam_status form_factors_count_seen(const mesh *m, const recipe *how, const uint32_t *elements, size_t count,
                                   const progress *steps, const char *stage, size_t *seen, lam_error *error) {
    lam_status status = LAM_OK;
    packed_rows rows = {0};
    TRY(find_some(m, how, elements, count, steps, stage, &rows, error));
    for (size_t k = 0; k < count; k++) seen[k] = rows.rows[elements[k]].n_entries;
done:
    packed_rows_free(&rows);
    return status;
}

lam_status form_factors_some_rows(const mesh *m, const recipe *how, const uint32_t *elements, size_t count,
                                  const progress *steps, const char *stage, csr *out, lam_error *error) {
    lam_status status = LAM_OK;
    packed_rows rows = {0};
    csr made = {.n = m->n};
    TRY(find_some(m, how, elements, count, steps, stage, &rows, error));
    made.indptr = memory_allocate(m->n + 1, sizeof *made.indptr, "rows of form factors", error);
    if (made.indptr == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < count; k++) made.indptr[elements[k] + 1] = rows.rows[elements[k]].n_entries;
    TRY(csr_begin_rows(&made, "rows of form factors", error));
    const double each = rows.kind == ROW_COUNTS ? 1 / (double)how->rays : 1;
    for (size_t k = 0; k < count; k++) {
        const packed_row *row = &rows.rows[elements[k]];
        const uint8_t *from = row->bytes;
        uint32_t column = 0, gap;
        float value;
        for (size_t p = 0; p < row->n_entries; p++) {
            from = row_get(rows.kind, from, &gap, &value);
            column += gap;
            made.indices[made.indptr[elements[k]]] = column++;
            made.data[made.indptr[elements[k]]++] = (float)(each * (double)value);
        }
    }
    csr_end_rows(&made);
    *out = made;
    made = (csr){0};
done:
    csr_free(&made);
    packed_rows_free(&rows);
    return status;
}
