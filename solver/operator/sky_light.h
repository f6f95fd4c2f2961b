/* The runtime half of a sky: first_bounce of an open store. */
#ifndef LAMBERT_OPERATOR_SKY_LIGHT_H
#define LAMBERT_OPERATOR_SKY_LIGHT_H

#include "store/store.h"

/* Loads /sky for n elements, or NULL where the store has none; freed by lam_sky_close.
 * Errors: LAM_ERR_FORMAT (another shape, a value that is negative or not finite), LAM_ERR_DAMAGED, _MEMORY.
 */
lam_status sky_load(store *s, size_t n, lam_sky **out, lam_error *error);

/* lam_sky_irradiance for refined answers: L [n_rows][m] and H0 [n_rows][n] in double. */
void sky_irradiance_double(const lam_sky *sky, size_t n_rows, const double *L, double *H0);

/* first_bounce [m][n], of the sky. */
const float *sky_first_bounce(const lam_sky *sky);

/* A sky of first_bounce [m][n], copied. Errors: LAM_ERR_MEMORY. */
lam_status sky_create(size_t n_tiles, size_t n, const float *first_bounce, lam_sky **out, lam_error *error);

#endif
