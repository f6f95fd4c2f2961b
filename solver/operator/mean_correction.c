#include "solver/operator/mean_correction.h"

#include "solver/base/half.h"

#include "store/groups.h"
#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void mean_correction_rest(mean_correction *e) {
    free(e->missing);
    free(e->light);
    free(e->lift);
    e->missing = NULL;
    e->light = NULL;
    e->lift = NULL;
}

void mean_correction_free(mean_correction *e) {
    mean_correction_rest(e);
    *e = (mean_correction){.n = 0};
}

static lam_status check(const mean_correction *e, lam_error *error) {
    lam_status status = LAM_OK;
    for (size_t k = 0; k < e->n * e->n_channels; k++)
        if (!isfinite(e->missing[k]))
            FAIL(error, LAM_ERR_NUMERIC, "missing[%zu] = %g, must be finite", k, (double)e->missing[k]);
    for (size_t c = 0; c < e->n_channels; c++)
        if (!(e->light[c] > 0 && e->light[c] < INFINITY))
            FAIL(error, LAM_ERR_NUMERIC, "even_light[%zu] = %g, must be above 0", c, e->light[c]);
done:
    return status;
}

static lam_status reserve(size_t n, size_t n_channels, mean_correction *e, lam_error *error) {
    *e = (mean_correction){.n = n,
                           .n_channels = n_channels,
                           .missing = memory_allocate(n_channels, n * sizeof *e->missing, "operator", error),
                           .light = memory_allocate(n_channels, sizeof *e->light, "operator", error)};
    return e->missing != NULL && e->light != NULL ? LAM_OK : LAM_ERR_MEMORY;
}

lam_status mean_correction_of_halves(size_t n, size_t n_channels, const uint16_t *missing,
                                     const double *light, mean_correction *out, lam_error *error) {
    lam_status status = LAM_OK;
    mean_correction e = {.n = 0};
    TRY(reserve(n, n_channels, &e, error));
    for (size_t k = 0; k < n * n_channels; k++) e.missing[k] = float_of_half(missing[k]);
    memcpy(e.light, light, n_channels * sizeof *light);
    TRY(check(&e, error));
    *out = e;
    e = (mean_correction){.n = 0};
done:
    mean_correction_free(&e);
    return status;
}

lam_status mean_correction_create(size_t n, size_t n_channels, const double *missing, const double *light,
                                  mean_correction *out, lam_error *error) {
    uint16_t *halves = memory_allocate(n_channels, n * sizeof *halves, "operator", error);
    if (halves == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < n * n_channels; k++) halves[k] = half_of_float((float)missing[k]);
    const lam_status status = mean_correction_of_halves(n, n_channels, halves, light, out, error);
    free(halves);
    return status;
}

lam_status mean_correction_save(const mean_correction *e, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    uint16_t *halves = NULL;
    const size_t count = e->n * e->n_channels;
    if (e->missing == NULL) return LAM_OK;
    halves = memory_allocate(count, sizeof *halves, "operator", error);
    if (halves == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < count; k++) halves[k] = half_of_float(e->missing[k]);
    TRY(store_write(s, STORE_OPERATOR "/missing", STORE_F16, 2, (size_t[]){e->n_channels, e->n}, halves,
                    error));
    TRY(store_write(s, STORE_OPERATOR "/even_light", STORE_F64, 1, &e->n_channels, e->light, error));
done:
    free(halves);
    return status;
}

double mean_correction_total(const double *parts) {
    return ((parts[0] + parts[1]) + (parts[2] + parts[3])) + ((parts[4] + parts[5]) + (parts[6] + parts[7]));
}

/* The partial sums, as one would wait for each addition in turn. */
double mean_correction_sum(const float *by, const float *x, size_t count) {
    double parts[MEAN_PARTS] = {0};
    size_t p = 0;
    for (; p + MEAN_PARTS <= count; p += MEAN_PARTS)
        for (size_t k = 0; k < MEAN_PARTS; k++) parts[k] += (double)by[p + k] * (double)x[p + k];
    for (size_t k = 0; p < count; p++, k++) parts[k] += (double)by[p] * (double)x[p];
    return mean_correction_total(parts);
}

lam_status mean_correction_lift(mean_correction *e, const float *by, lam_error *error) {
    if (e->missing == NULL) return LAM_OK;
    e->lift = memory_allocate(e->n_channels, e->n * sizeof *e->lift, "operator", error);
    if (e->lift == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < e->n * e->n_channels; k++) e->lift[k] = by[k] * e->missing[k];
    return LAM_OK;
}

size_t mean_correction_bytes(const mean_correction *e) {
    return e->n * e->n_channels * sizeof *e->lift;
}
