/* The difference that the way of an answer makes to the sun of a year, in a tile or by few rays, measured by
 * more rays at some elements. */
#ifndef LAMBERT_LIGHT_SUN_WAY_H
#define LAMBERT_LIGHT_SUN_WAY_H

#include "solver/light/sunlight.h"

typedef struct sun_way {
    size_t n;
    uint32_t *elements; /* [n] */
    double *off;        /* [n], direct irradiance by the way less that by more rays, mean of all vectors */
    bool exact;         /* by rays: off of one element says nothing of another */
} sun_way;

void sun_way_free(sun_way *w);

/* Measures at up to 64 of the elements selected (NULL: of all), evenly spread over their numbers, and in up
 * to 1024 sunny vectors: at n_points points of an element, or, where that is 0, by the tile that holds the
 * sun, against 16 points (sun_rays.h). suns [n_vectors] is copied. n is 0 where no sun shines. Cost: a
 * million rays. Errors: as sunlight_create. */
lam_status sun_way_measure(store *s, const mesh *m, const lam_sky *sky, const year_sun *suns,
                           size_t n_vectors, size_t n_points, size_t n_selected, const uint32_t *selected,
                           const progress *steps, sun_way *out, lam_error *error);

/* The part of an error: off over values [C][n] of the quantity, which are `scale` times a mean of the
 * vectors, root mean square by area. Of means over `n_together` elements rays are off by less, as by chance.
 * 0 where nothing was measured, or the values are 0 there. */
double sun_way_error(const sun_way *w, const mesh *m, lam_quantity quantity, const float *values,
                     double scale, size_t n_together);

#endif
