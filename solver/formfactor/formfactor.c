#include "solver/formfactor/formfactor.h"

#include "solver/clock.h"
#include "solver/formfactor/hemicube.h"
#include "solver/formfactor/pairs.h"
#include "solver/formfactor/rays.h"
#include "solver/formfactor/repair.h"
#include "solver/formfactor/upper.h"
#include "solver/formfactor/visibility.h"

#include <math.h>
#include <stdlib.h>

/* A scene is closed when less than this share of its rays leaves: in single precision a few rays slip between
 * elements that meet without sharing vertices, or start behind a neighbour and meet its back. Their share is
 * put back by the repair. */
static const double crack_share = 1e-4;

void form_factors_free(form_factors *f) {
    csr_free(&f->F);
    csr_free(&f->upper);
    free(f->row_sums);
    free(f->leaving);
    free(f->absorbed);
    *f = (form_factors){0};
}

static double area_mean(const mesh *m, const double *x) {
    double sum = 0, total = 0;
    for (size_t i = 0; i < m->n; i++) {
        sum += m->area[i] * x[i];
        total += m->area[i];
    }
    return total > 0 ? sum / total : 0;
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

/* From one-sided rows, which are freed, whose entries are F_ij times rays, to the upper triangle. */
static lam_status form_factors_finish(form_factors *f, const mesh *m, found_rows *rows, size_t rays,
                                      lam_error *error) {
    lam_status status = LAM_OK;
    double *outside = memory_allocate(m->n, sizeof *outside, "form factors", error);
    if (outside == NULL) TRY(LAM_ERR_MEMORY);
    f->rows_kept = rows->kept;
    TRY(upper_merge(rows, rays, m->area, &f->upper, error));
    found_rows_free(rows);
    f->leaving_share = area_mean(m, f->leaving);
    f->absorbed_share = area_mean(m, f->absorbed);
    f->closed = f->leaving_share < crack_share;
    for (size_t i = 0; i < m->n; i++)
        outside[i] = (f->closed ? 0 : f->leaving[i]) + (f->absorbed_share < crack_share ? 0 : f->absorbed[i]);
    TRY(repair_close(&f->upper, m->area, outside, f, error));
done:
    free(outside);
    return status;
}

static lam_status make_of_rays(const mesh *m, const visibility *v, const uint32_t *order,
                               const form_factor_options *options, form_factors *f, lam_error *error) {
    lam_status status = LAM_OK;
    found_rows counts = {0};
    TRY(rays_count(m, v, order, options, &counts, f->leaving, f->absorbed, error));
    TRY(form_factors_finish(f, m, &counts, options->recipe.rays, error));
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
    TRY(form_factors_finish(f, m, &rows, 1, error));
done:
    hemicube_free(&h);
    found_rows_free(&rows);
    return status;
}

static lam_status make_of_pairs(const mesh *m, const visibility *v, const uint32_t *order,
                                const form_factor_options *options, form_factors *f, lam_error *error) {
    lam_status status = LAM_OK;
    found_rows counts = {0};
    double *outside = NULL;
    pairs_report report;
    form_factor_options silent = *options;
    silent.progress = NULL;
    silent.scratch = NULL;
    const pairs_options how = {.tolerance = 1e-6,
                               .accuracy = options->recipe.accuracy,
                               .segments = 16,
                               .seed = options->recipe.seed,
                               .progress = options->progress,
                               .stage = options->stage};
    if (m->n > PAIRS_ELEMENTS_MOST)
        FAIL(error, LAM_ERR_ARGUMENT, "%zu elements have too many pairs; at most %d", m->n,
             PAIRS_ELEMENTS_MOST);
    outside = memory_allocate(m->n, sizeof *outside, "form factors", error);
    if (outside == NULL) TRY(LAM_ERR_MEMORY);
    TRY(rays_count(m, v, order, &silent, &counts, f->leaving, f->absorbed, error));
    found_rows_free(&counts);
    TRY(pairs_exchange(m, v, &how, &f->F, &report, error));
    f->pairs_facing = report.facing;
    f->pairs_open = report.open;
    f->pairs_hidden = report.hidden;
    f->leaving_share = area_mean(m, f->leaving);
    f->absorbed_share = area_mean(m, f->absorbed);
    f->closed = f->leaving_share < crack_share;
    for (size_t i = 0; i < m->n && !(f->closed && f->absorbed_share < crack_share); i++) {
        double seen = 0;
        for (uint64_t p = f->F.indptr[i]; p < f->F.indptr[i + 1]; p++) seen += (double)f->F.data[p];
        outside[i] = fmax(0, 1 - seen / m->area[i]);
    }
    upper_fold(&f->F);
    f->upper = f->F;
    f->F = (csr){0};
    TRY(repair_close(&f->upper, m->area, outside, f, error));
done:
    found_rows_free(&counts);
    free(outside);
    return status;
}

lam_status form_factors_make(const mesh *m, const uint32_t *order, const form_factor_options *options,
                             form_factors *out, lam_error *error) {
    lam_status status = LAM_OK;
    visibility *v = NULL;
    form_factors f = {.recipe = options->recipe};
    TRY(recipe_check(&options->recipe, error));
    f.leaving = memory_allocate(m->n, sizeof *f.leaving, "form factors", error);
    f.absorbed = memory_allocate(m->n, sizeof *f.absorbed, "form factors", error);
    if (f.leaving == NULL || f.absorbed == NULL) TRY(LAM_ERR_MEMORY);
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
    }
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

/* The mean of row i of two CSRs; returns how many indices either has. With indices NULL it only counts. */
static size_t mean_row(const csr *a, const csr *b, size_t i, uint32_t *indices, float *data) {
    uint64_t p = a->indptr[i], q = b->indptr[i];
    size_t length = 0;
    while (p < a->indptr[i + 1] || q < b->indptr[i + 1]) {
        const uint32_t ja = p < a->indptr[i + 1] ? a->indices[p] : UINT32_MAX;
        const uint32_t jb = q < b->indptr[i + 1] ? b->indices[q] : UINT32_MAX;
        const uint32_t j = ja < jb ? ja : jb;
        float sum = 0;
        if (ja == j) sum += .5f * a->data[p++];
        if (jb == j) sum += .5f * b->data[q++];
        if (indices != NULL) {
            indices[length] = j;
            data[length] = sum;
        }
        length++;
    }
    return length;
}

lam_status form_factors_mean(const form_factors *a, const form_factors *b, form_factors *out,
                             lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = a->F.n;
    form_factors f = *a;
    f.F = (csr){.n = n};
    f.upper = (csr){0};
    f.row_sums = f.leaving = f.absorbed = NULL;
    f.recipe.rays = a->recipe.rays + b->recipe.rays;
    if (b->F.n != n)
        FAIL(error, LAM_ERR_ARGUMENT, "form factors of %zu and %zu elements cannot be averaged", n, b->F.n);
    f.row_sums = memory_allocate(n, sizeof *f.row_sums, "form factors", error);
    f.leaving = memory_allocate(n, sizeof *f.leaving, "form factors", error);
    f.absorbed = memory_allocate(n, sizeof *f.absorbed, "form factors", error);
    f.F.indptr = memory_allocate(n + 1, sizeof *f.F.indptr, "form factors", error);
    if (f.row_sums == NULL || f.leaving == NULL || f.absorbed == NULL || f.F.indptr == NULL)
        TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) f.F.indptr[i + 1] = f.F.indptr[i] + mean_row(&a->F, &b->F, i, NULL, NULL);
    f.F.indices = memory_allocate(f.F.indptr[n], sizeof *f.F.indices, "form factors", error);
    f.F.data = memory_allocate(f.F.indptr[n], sizeof *f.F.data, "form factors", error);
    if (f.F.indices == NULL || f.F.data == NULL) TRY(LAM_ERR_MEMORY);
#pragma omp parallel for schedule(static, 64)
    for (size_t i = 0; i < n; i++) {
        mean_row(&a->F, &b->F, i, f.F.indices + f.F.indptr[i], f.F.data + f.F.indptr[i]);
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
