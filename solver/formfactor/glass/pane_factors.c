#include "solver/formfactor/glass/pane_factors.h"

#include "solver/formfactor/glass/pane_light.h"
#include "solver/formfactor/rows/upper.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char stage[] = "light through panes";

size_t panes_rays(const recipe *r) {
    enum { LEAST = 512 };
    return r->rays / 2 > LEAST ? r->rays / 2 : LEAST;
}

/* The rows, unless rows is NULL, and the bins of a sky, unless bounce is NULL. */
static lam_status find(const mesh *m, const visibility *v, const uint32_t *order,
                       const form_factor_options *options, size_t rays, uint64_t seed, packed_rows *rows,
                       sky_bounce *bounce, lam_error *error) {
    lam_status status = LAM_OK;
    packed_rows unused = {0};
    const recipe how = {.source = options->recipe.source, .rays = rays, .seed = seed};
    const pane_light_options wanted = {.recipe = &how,
                                       .rays = (rays + VISIBILITY_PACKET - 1) / VISIBILITY_PACKET *
                                               VISIBILITY_PACKET,
                                       .sky = bounce,
                                       .without_rows = rows == NULL,
                                       .progress = options->progress,
                                       .stage = stage};
    TRY(pane_light_make(m, v, order, &wanted, rows != NULL ? rows : &unused, error));
done:
    packed_rows_free(&unused);
    return status;
}

/* first_bounce += that of the bins through panes. */
static lam_status add_bins(sky_bounce *bins, sky_bounce *bounce, double *ground, lam_error *error) {
    const size_t count = bounce->tiling.n_tiles * bounce->n;
    double *ones = memory_allocate(bounce->n, sizeof *ones, "light through panes", error);
    if (ones == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < bounce->n; i++) {
        ones[i] = 1;
        if (ground != NULL) ground[i] += bins->ground[i];
    }
    sky_bounce_close(bins, ones);
    for (size_t k = 0; k < count; k++) bounce->first_bounce[k] += bins->first_bounce[k];
    free(ones);
    return LAM_OK;
}

/* Adds the entries of upper that `more` has, too, to those of more. */
static void add_common(const csr *upper, csr *more) {
#pragma omp parallel for schedule(static, 64)
    for (size_t i = 0; i < more->n; i++) {
        uint64_t at = upper->indptr[i];
        for (uint64_t p = more->indptr[i]; p < more->indptr[i + 1]; p++) {
            while (at < upper->indptr[i + 1] && upper->indices[at] < more->indices[p]) at++;
            if (at < upper->indptr[i + 1] && upper->indices[at] == more->indices[p])
                more->data[p] += upper->data[at];
        }
    }
}

/* Adds the exchange of more, A_i F_ij, to the row sums of f; returns that of all elements over their area. */
static double add_sums(const csr *more, const double *area, form_factors *f) {
    double sum = 0, all = 0;
    for (size_t i = 0; i < more->n; i++) {
        all += area[i];
        for (uint64_t p = more->indptr[i]; p < more->indptr[i + 1]; p++) {
            const double g = (double)more->data[p];
            f->row_sums[i] += g / area[i];
            f->row_sums[more->indices[p]] += g / area[more->indices[p]];
            sum += 2 * g;
        }
    }
    return sum / all;
}

lam_status panes_add(const mesh *m, const visibility *v, const uint32_t *order,
                     const form_factor_options *options, size_t rays, uint64_t seed, form_factors *f,
                     lam_error *error) {
    lam_status status = LAM_OK;
    packed_rows rows = {0};
    sky_bounce bins = {.n = 0};
    csr more = {.n = 0}, sum = {.n = 0};
    const sky_bounce *sky = &f->sky;
    if (m->glass == NULL) return LAM_OK;
    if (sky->first_bounce != NULL)
        TRY(sky_bounce_create(sky->tiling.name, m->up, sky->ground_albedo, m->n, &bins, error));
    TRY(find(m, v, order, options, rays, seed, &rows, sky->first_bounce != NULL ? &bins : NULL, error));
    if (sky->first_bounce != NULL) TRY(add_bins(&bins, &f->sky, NULL, error));
    TRY(upper_merge(&rows, 1, m->area, NULL, &more, error));
    packed_rows_free(&rows);
    if (more.indptr[more.n] == 0) goto done;
    f->panes = add_sums(&more, m->area, f);
    add_common(&f->upper, &more);
    TRY(csr_replace(&f->upper, &more, &sum, error));
    csr_free(&f->upper);
    f->upper = sum;
    sum = (csr){.n = 0};
done:
    packed_rows_free(&rows);
    sky_bounce_free(&bins);
    csr_free(&more);
    csr_free(&sum);
    return status;
}

lam_status panes_add_bounce(const mesh *m, const visibility *v, const uint32_t *order,
                            const form_factor_options *options, size_t rays, uint64_t seed,
                            sky_bounce *bounce, double *ground, lam_error *error) {
    lam_status status = LAM_OK;
    sky_bounce bins = {.n = 0};
    if (m->glass == NULL) return LAM_OK;
    TRY(sky_bounce_create(bounce->tiling.name, m->up, bounce->ground_albedo, m->n, &bins, error));
    TRY(find(m, v, order, options, rays, seed, NULL, &bins, error));
    TRY(add_bins(&bins, bounce, ground, error));
done:
    sky_bounce_free(&bins);
    return status;
}

lam_status panes_add_sky(const mesh *m, const visibility *v, const uint32_t *order,
                         const form_factor_options *options, size_t rays, uint64_t seed, form_factors *f,
                         lam_error *error) {
    lam_status status = LAM_OK;
    double between = 0;
    if (m->glass == NULL) return LAM_OK;
    TRY(pane_light_between(m, v, &between, error));
    if (between > 0)
        FAIL(error, LAM_ERR_ARGUMENT,
             "blocks: %.2g %% of the light comes to other elements through panes, which blocks do not have; "
             "give --form-factors rays",
             100 * between);
    if (f->sky.first_bounce != NULL)
        TRY(panes_add_bounce(m, v, order, options, rays, seed, &f->sky, NULL, error));
done:
    return status;
}
