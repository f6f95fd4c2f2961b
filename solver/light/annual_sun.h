/* Hours of direct sun in a year. Private to annual.c. */
#ifndef LAMBERT_LIGHT_ANNUAL_SUN_H
#define LAMBERT_LIGHT_ANNUAL_SUN_H

#include "solver/light/annual.h"

/* Fills the figures of the sun in made [n_figures][C][width] and leaves the others alone: of the vectors of
 * these numbers, at the sensors that the sun is wanted at, else on elements, of which width are selected
 * (NULL: all). Errors: LAM_ERR_ARGUMENT (sun is NULL), LAM_ERR_CANCELLED, LAM_ERR_MEMORY. Cost: the rays of
 * each vector. */
lam_status annual_sun_find(const annual_options *o, const sunlight *sun, size_t n_vectors,
                           const size_t *vectors, size_t width, const uint32_t *selected, size_t C,
                           const progress *steps, float *made, lam_error *error);

#endif
