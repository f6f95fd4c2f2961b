#include "solver/formfactor/glass/pane_factors.h"

#include "solver/formfactor/glass/pane_light.h"
#include "solver/formfactor/rows/upper.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char stage[] = "light through panes";

pane_samples panes_beside(const recipe *r) {
    enum { LEAST = 512 };
    return (pane_samples){
        .rays = r->rays / 2 > LEAST ? r->rays / 2 : LEAST, .n_seeds = 1, .seeds = {r->seed}};
}

/* The rows of sample k, unless rows is NULL, and the bins of a sky, unless bounce is NULL. */
static lam_status find(const mesh *m, const visibility *v, const uint32_t *order,
                       const form_factor_options *options, const pane_samples *samples, size_t k,
                       packed_rows *rows, sky_bounce *bounce, lam_error *error) {
    lam_status status = LAM_OK;
    packed_rows unused = {0};
    const size_t rays = (samples->rays + VISIBILITY_PACKET - 1) / VISIBILITY_PACKET * VISIBILITY_PACKET;
    const recipe how = {.source = options->recipe.source, .rays = rays, .seed = samples->seeds[k]};
    const pane_light_options wanted = {.recipe = &how,
                                       .rays = rays,
                                       .sky = bounce,
                                       .without_rows = rows == NULL,
                                       .progress = options->progress,
                                       .stage = stage};
    TRY(pane_light_make(m, v, order, &wanted, rows != NULL ? rows : &unused, error));
done:
    packed_rows_free(&unused);
    return status;
}

/* first_bounce += share times that of the bins through panes. */
static lam_status add_bins(sky_bounce *bins, double share, sky_bounce *bounce, double *ground,
                           lam_error *error) {
    const size_t count = bounce->tiling.n_tiles * bounce->n;
    double *shares = memory_allocate(bounce->n, sizeof *shares, stage, error);
    if (shares == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < bounce->n; i++) {
        shares[i] = share;
        if (ground != NULL) ground[i] += share * bins->ground[i];
    }
    sky_bounce_close(bins, shares);
    for (size_t k = 0; k < count; k++) bounce->first_bounce[k] += bins->first_bounce[k];
    free(shares);
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

/* Adds the exchange of more, A_i F_ij, to the row sums of f. */
static void add_sums(const csr *more, const double *area, form_factors *f) {
    for (size_t i = 0; i < more->n; i++)
        for (uint64_t p = more->indptr[i]; p < more->indptr[i + 1]; p++) {
            const uint32_t j = more->indices[p];
            f->row_sums[i] += (double)more->data[p] / area[i];
            f->row_sums[j] += (double)more->data[p] / area[j];
        }
}

/* upper += share times the rows, which are freed. */
static lam_status add_rows(const mesh *m, packed_rows *rows, double share, form_factors *f,
                           lam_error *error) {
    lam_status status = LAM_OK;
    csr more = {.n = 0}, sum = {.n = 0};
    TRY(upper_merge(rows, 1, m->area, NULL, &more, error));
    packed_rows_free(rows);
    if (more.indptr[more.n] == 0) goto done;
    for (uint64_t p = 0; p < more.indptr[more.n]; p++) more.data[p] *= (float)share;
    add_sums(&more, m->area, f);
    add_common(&f->upper, &more);
    TRY(csr_replace(&f->upper, &more, &sum, error));
    csr_free(&f->upper);
    f->upper = sum;
    sum = (csr){.n = 0};
done:
    csr_free(&more);
    csr_free(&sum);
    return status;
}

/* To the rows of f and to a sky; either may be NULL. */
static lam_status add(const mesh *m, const visibility *v, const uint32_t *order,
                      const form_factor_options *options, const pane_samples *samples, form_factors *f,
                      sky_bounce *sky, double *ground, lam_error *error) {
    lam_status status = LAM_OK;
    packed_rows rows = {0};
    sky_bounce bins = {.n = 0};
    const double share = 1 / (double)samples->n_seeds;
    if (m->glass == NULL) return LAM_OK;
    for (size_t k = 0; k < samples->n_seeds; k++) {
        sky_bounce_free(&bins);
        if (sky != NULL)
            TRY(sky_bounce_create(sky->tiling.name, m->up, sky->ground_albedo, m->n, &bins, error));
        TRY(find(m, v, order, options, samples, k, f != NULL ? &rows : NULL, sky != NULL ? &bins : NULL,
                 error));
        if (sky != NULL) TRY(add_bins(&bins, share, sky, ground, error));
        if (f != NULL) TRY(add_rows(m, &rows, share, f, error));
    }
done:
    packed_rows_free(&rows);
    sky_bounce_free(&bins);
    return status;
}

lam_status panes_add(const mesh *m, const visibility *v, const uint32_t *order,
                     const form_factor_options *options, const pane_samples *samples, form_factors *f,
                     lam_error *error) {
    sky_bounce *const sky = f->sky.first_bounce != NULL ? &f->sky : NULL;
    return add(m, v, order, options, samples, f, sky, NULL, error);
}

lam_status panes_add_bounce(const mesh *m, const visibility *v, const uint32_t *order,
                            const form_factor_options *options, const pane_samples *samples,
                            sky_bounce *bounce, double *ground, lam_error *error) {
    return add(m, v, order, options, samples, NULL, bounce, ground, error);
}
