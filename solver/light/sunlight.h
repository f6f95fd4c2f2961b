/* The sun itself on the elements of a scene, hour by hour, in place of the tile of sky that holds it. */
#ifndef LAMBERT_LIGHT_SUNLIGHT_H
#define LAMBERT_LIGHT_SUNLIGHT_H

#include "lambert/lambert.h"
#include "solver/daylight/year.h"
#include "solver/formfactor/visibility/sun_rays.h"
#include "store/store.h"

/* What the sun of vector h adds to an element's irradiance before any bounce: its normal irradiance times
 * max(0, n . s) V, V the share of the element that sees it, and what an unshaded ground of the store's albedo
 * sends up of it; and, where the answer holds the sun of the tiles already, less what that gives directly. */
typedef struct sunlight {
    size_t n_vectors, n; /* hours, elements */
    year_sun *suns;      /* [n_vectors] */
    sun_rays *rays;
    const lam_sky *sky; /* borrowed; NULL: no sun is in the tiles */
    sky_tiling tiling;
    float *ground; /* [n], of the irradiance of the ground */
    float *given;  /* [n]: one vector that is known; then there is nothing of the above */
} sunlight;

/* Takes over suns [n_vectors], also on an error. Rays are n_points an element, of those wanted or, where that
 * is NULL, of all. in_tiles: the sky whose answers have the sun in a tile, or NULL. What the ground sends to
 * an element is told from the tiles that it does not see, first_bounce = a F_ground c there: the least of
 * first_bounce / c, but no more than an element so inclined sees of an open ground, a (1 - n_up) / 2.
 * Errors: those of the store's /sky, LAM_ERR_MEMORY, LAM_ERR_INTERNAL. */
lam_status sunlight_create(store *s, const mesh *m, year_sun *suns, size_t n_vectors, size_t n_points,
                           size_t n_wanted, const uint32_t *wanted, const lam_sky *in_tiles, sunlight *out,
                           lam_error *error);
void sunlight_free(sunlight *s);

/* Whether there is any sun in a vector. */
bool sunlight_shines(const sunlight *s, size_t vector);

enum { SUNLIGHT_MOST = 64 };

/* Numbers that work below must have room for. */
size_t sunlight_work(const sunlight *s);

/* H [n_vectors][n] of at most SUNLIGHT_MOST vectors by their numbers; work is overwritten. Elements that are
 * not wanted get no meaningful value. */
void sunlight_irradiance(const sunlight *s, size_t n_vectors, const size_t *vectors, float *H, float *work);

/* The mean of all vectors as one. Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status sunlight_mean(const sunlight *s, const progress *steps, sunlight *out, lam_error *error);

#endif
