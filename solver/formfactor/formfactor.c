#include "solver/formfactor/formfactor.h"

#include "solver/base/clock.h"
#include "solver/formfactor/leaving.h"
#include "solver/formfactor/pairs/recipe_pairs.h"
#include "solver/formfactor/rays/hemicube.h"
#include "solver/formfactor/rays/rays.h"
#include "solver/formfactor/repair.h"
#include "solver/formfactor/rows/row_merge.h"
#include "solver/formfactor/rows/upper.h"
#include "solver/formfactor/visibility/visibility.h"

#include <math.h>
#include <stdlib.h>

void form_factors_free(form_factors *f) {
    csr_free(&f->F);
    csr_free(&f->upper);
    free(f->row_sums);
    free(f->leaving);
    free(f->absorbed);
    free(f->repair);
    sky_bounce_free(&f->sky);
    *f = (form_factors){0};
}

lam_status form_factors_expand(form_factors *f, const double *area, lam_error *error) {
    if (f->upper.indptr == NULL) return LAM_OK;
    f->F = f->upper;
    f->upper = (csr){0};
    return upper_expand(&f->F, area, f->row_sums, error);
}

lam_status form_factors_gather(form_factors *f, const double *area, lam_error *error) {
    if (f->F.indptr == NULL) return LAM_OK;
    f->upper = f->F;
    f->F = (csr){0};
    return upper_gather(&f->upper, area, error);
}

/* Repairs exchange areas by what their rays say leaves. */
static lam_status close_upper(form_factors *f, const mesh *m, lam_error *error) {
    double *outside = memory_allocate(m->n, sizeof *outside, "form factors", error);
    if (outside == NULL) return LAM_ERR_MEMORY;
    closing_measure(f, m);
    for (size_t i = 0; i < m->n; i++) outside[i] = closing_outside(f, i);
    const lam_status status = repair_close(&f->upper, m->area, outside, f, error);
    free(outside);
    return status;
}

/* From one-sided rows, which are freed, whose entries are F_ij times rays, to the upper triangle. */
static lam_status form_factors_finish(form_factors *f, const mesh *m, found_rows *rows, size_t rays,
                                      const large_place *place, lam_error *error) {
    lam_status status = LAM_OK;
    f->rows_kept = rows->kept;
    TRY(upper_merge(rows, rays, m->area, place, &f->upper, error));
    found_rows_free(rows);
    TRY(close_upper(f, m, error));
done:
    return status;
}

static lam_status make_of_rays(const mesh *m, const visibility *v, const uint32_t *order,
                               const form_factor_options *options, form_factors *f, lam_error *error) {
    lam_status status = LAM_OK;
    found_rows counts = {0};
    TRY(rays_count(m, v, order, options, &counts, f->leaving, f->absorbed, error));
    TRY(form_factors_finish(f, m, &counts, options->recipe.rays, options->large, error));
done:
    found_rows_free(&counts);
    return status;
}

static lam_status make_of_hemicubes(const mesh *m, const visibility *v, const uint32_t *order,
                                    const form_factor_options *options, form_factors *f, lam_error *error) {
    lam_status status = LAM_OK;
    hemicube h = {0};
    found_rows rows = {0};
    TRY(hemicube_create(options->recipe.resolution, &h, error));
    TRY(hemicube_trace(&h, m, v, order, options, &rows, f->leaving, f->absorbed, error));
    /* The weights are form factors already, as if one ray had been cast. */
    TRY(form_factors_finish(f, m, &rows, 1, options->large, error));
done:
    hemicube_free(&h);
    found_rows_free(&rows);
    return status;
}

static lam_status make_of_pairs(const mesh *m, const visibility *v, const uint32_t *order,
                                const form_factor_options *options, form_factors *f, lam_error *error) {
    lam_status status = LAM_OK;
    found_rows counts = {0};
    form_factor_options silent = *options;
    silent.progress = NULL;
    silent.scratch = NULL;
    double *outside = memory_allocate(m->n, sizeof *outside, "form factors", error);
    if (outside == NULL) return LAM_ERR_MEMORY;
    TRY(rays_count(m, v, order, &silent, &counts, f->leaving, f->absorbed, error));
    found_rows_free(&counts);
    TRY(recipe_pairs_find(m, v, options, 0, f, &f->upper, error));
    closing_measure(f, m);
    if (!closing_all_stays(f)) {
        /* What a row lacks goes outside: 1 - sum_j g_ij / A_i. */
        for (size_t i = 0; i < m->n; i++)
            for (uint64_t p = f->upper.indptr[i]; p < f->upper.indptr[i + 1]; p++) {
                outside[i] += (double)f->upper.data[p];
                outside[f->upper.indices[p]] += (double)f->upper.data[p];
            }
        for (size_t i = 0; i < m->n; i++) outside[i] = fmax(0, 1 - outside[i] / m->area[i]);
    }
    TRY(repair_close(&f->upper, m->area, outside, f, error));
done:
    found_rows_free(&counts);
    free(outside);
    return status;
}

static lam_status make_of_near_pairs(const mesh *m, const visibility *v, const uint32_t *order,
                                     const form_factor_options *options, form_factors *f, lam_error *error) {
    lam_status status = LAM_OK;
    found_rows counts = {0};
    csr near = {0}, counted = {0};
    TRY(recipe_pairs_find(m, v, options, recipe_near(&options->recipe), f, &near, error));
    TRY(rays_count(m, v, order, options, &counts, f->leaving, f->absorbed, error));
    if (counts.kept > f->rows_kept) f->rows_kept = counts.kept;
    TRY(upper_merge(&counts, options->recipe.rays, m->area, options->large, &counted, error));
    found_rows_free(&counts);
    TRY(rows_replace(&counted, &near, &f->upper, error));
    csr_free(&near);
    csr_free(&counted);
    TRY(close_upper(f, m, error));
done:
    found_rows_free(&counts);
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
    TRY(visibility_create(m, &v, error));
    switch (options->recipe.method) {
    case RECIPE_RAYS:
        TRY(make_of_rays(m, v, order, options, &f, error));
        break;
    case RECIPE_HEMICUBE:
        TRY(make_of_hemicubes(m, v, order, options, &f, error));
        break;
    case RECIPE_PAIRS:
        TRY(make_of_pairs(m, v, order, options, &f, error));
        break;
    case RECIPE_NEAR_PAIRS:
        TRY(make_of_near_pairs(m, v, order, options, &f, error));
        break;
    }
    if (asked->sky != NULL) TRY(closing_sky(&f, m->n, error));
    if (!options->upper) TRY(form_factors_expand(&f, m->area, error));
    *out = f;
    f = (form_factors){0};
done:
    visibility_destroy(v);
    form_factors_free(&f);
    return status;
}

lam_status form_factors_ray_rate(const mesh *m, const uint32_t *order, double *rays_per_second,
                                 lam_error *error) {
    enum { ELEMENTS = 256, RAYS = 512, LONG_ENOUGH = 16 };
    static const double trial_seconds = .02;
    lam_status status = LAM_OK;
    visibility *v = NULL;
    TRY(visibility_create(m, &v, error));
    rays_cast_some(m, v, order, ELEMENTS, VISIBILITY_PACKET); /* threads start, caches fill */
    size_t cast = 0;
    const double started = clock_seconds();
    double seconds = 0;
    for (int k = 0; k < LONG_ENOUGH && seconds < trial_seconds; k++) {
        rays_cast_some(m, v, order, ELEMENTS, RAYS);
        cast += ELEMENTS * RAYS;
        seconds = clock_seconds() - started;
    }
    *rays_per_second = (double)cast / fmax(seconds, 1e-6);
done:
    visibility_destroy(v);
    return status;
}

lam_status form_factors_mean(const form_factors *a, const form_factors *b, form_factors *out,
                             lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = a->F.n;
    form_factors f = *a;
    f.F = (csr){.n = n};
    f.upper = (csr){0};
    f.row_sums = f.leaving = f.absorbed = f.repair = NULL;
    f.sky = (sky_bounce){0};
    f.recipe.rays = a->recipe.rays + b->recipe.rays;
    f.row_sums = memory_allocate(n, sizeof *f.row_sums, "form factors", error);
    f.leaving = memory_allocate(n, sizeof *f.leaving, "form factors", error);
    f.absorbed = memory_allocate(n, sizeof *f.absorbed, "form factors", error);
    if (f.row_sums == NULL || f.leaving == NULL || f.absorbed == NULL) TRY(LAM_ERR_MEMORY);
    TRY(rows_combine(&a->F, .5f, &b->F, .5f, &f.F, error));
#pragma omp parallel for schedule(static, 64)
    for (size_t i = 0; i < n; i++) {
        for (uint64_t p = f.F.indptr[i]; p < f.F.indptr[i + 1]; p++) f.row_sums[i] += (double)f.F.data[p];
        f.leaving[i] = .5 * (a->leaving[i] + b->leaving[i]);
        f.absorbed[i] = .5 * (a->absorbed[i] + b->absorbed[i]);
    }
    *out = f;
    f = (form_factors){0};
done:
    form_factors_free(&f);
    return status;
}
