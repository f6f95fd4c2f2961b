/* Correction of an operator by its error for one emission E0 that is everywhere and whose answer is known, in
 * proportion to the mean of any other emission: coefficients too small to be stored are nothing to one
 * emitter, and together much of the light of a sky. */
#ifndef LAMBERT_OPERATOR_MEAN_CORRECTION_H
#define LAMBERT_OPERATOR_MEAN_CORRECTION_H

#include "store/store.h"

#include <stdbool.h>
#include <stdint.h>

/* H += missing sum_j A_j E_j / light, light = sum_j A_j E0_j of the light E0 whose irradiance was too small
 * by missing. */
typedef struct mean_correction {
    size_t n, n_channels;
    float *missing; /* [C][n], by position, rounded to half precision; NULL: nothing is missing, n is 0 */
    double *light;  /* [C], m^2 */
    float *lift;    /* [C][n], made by mean_correction_lift */
} mean_correction;

void mean_correction_free(mean_correction *e);

/* From missing [C][n], by position, which is rounded, and light [C]; both are copied. Errors: LAM_ERR_MEMORY,
 * LAM_ERR_NUMERIC where a number is not finite, or a light not above 0. */
lam_status mean_correction_create(size_t n, size_t n_channels, const double *missing, const double *light,
                                  mean_correction *out, lam_error *error);

/* The same from the arrays of a store, whose numbers have half precision. */
lam_status mean_correction_of_halves(size_t n, size_t n_channels, const uint16_t *missing,
                                     const double *light, mean_correction *out, lam_error *error);

/* /operator/missing [C][n] f16 and /operator/even_light [C] f64, both or none. Errors: as store_write. */
lam_status mean_correction_save(const mean_correction *e, store *s, lam_error *error);

/* lift = by missing, by [C][n] by position: before the first product. Errors: LAM_ERR_MEMORY. */
lam_status mean_correction_lift(mean_correction *e, const float *by, lam_error *error);

/* sum_p by_p x_p of some positions. A product adds y += lift (sum_j A_j x_j) / light, or, adjoint,
 * y += A (sum_i lift_i x_i) / light. */
double mean_correction_sum(const float *by, const float *x, size_t count);

/* Such a sum has partial sums side by side: of number p in parts[p % MEAN_PARTS], added up by
 * mean_correction_total. */
enum { MEAN_PARTS = 8 };
double mean_correction_total(const double *parts);

/* Bytes that a product reads, also after mean_correction_rest has freed the arrays: they are to be made anew.
 */
void mean_correction_rest(mean_correction *e);
size_t mean_correction_bytes(const mean_correction *e);

#endif
