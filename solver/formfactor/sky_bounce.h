/* The first bounce of a sky: H0 = first_bounce^T L, the direct irradiance of every element under tile
 * radiances L. Rays that leave the scene are binned by tile; the bins become first_bounce, and /sky of a
 * store. */
#ifndef LAMBERT_FORMFACTOR_SKY_BOUNCE_H
#define LAMBERT_FORMFACTOR_SKY_BOUNCE_H

#include "solver/daylight/sky_tiles.h"
#include "store/store.h"

/* All zero: no sky. */
typedef struct sky_bounce {
    sky_tiling tiling;
    double ground_albedo;
    double north; /* degrees, of the model (sun.h); a sun is turned by it, and the bounce does not know it */
    size_t n;
    /* [m][n], sr: pi F_i,tile; until sky_bounce_close, the shares of an element's rays */
    float *first_bounce;
    double *ground; /* [n], the share that leaves below the horizon; NULL after sky_bounce_close */
} sky_bounce;

/* Empty bins for n elements under a tiling (see sky_tiling_create); a ground of albedo 0 to 1.
 * Errors: LAM_ERR_ARGUMENT, LAM_ERR_MEMORY. */
lam_status sky_bounce_create(const char *tiling, char up, double ground_albedo, size_t n, sky_bounce *out,
                             lam_error *error);
void sky_bounce_free(sky_bounce *s);

/* Adds the weight of each ray of a packet that leaves the scene (a bit of leaving) to sums, [m + 1], at its
 * tile. */
void sky_bounce_add(const sky_bounce *s, const float direction[3][SKY_PACKET], unsigned leaving,
                    const double weight[SKY_PACKET], double *sums);

/* Stores the bins of one element: sums, [m + 1], its weights on each tile and on the ground, divided by
 * whole, the weight of all its rays. Zeroes sums. From any number of threads, each element once. */
void sky_bounce_put(sky_bounce *s, size_t element, double *sums, double whole);

/* Turns shares into first_bounce: scales those of element i by scale[i] and distributes the share of the
 * ground over the tiles that light it. */
void sky_bounce_close(sky_bounce *s, const double *scale);

/* /sky of a store. Loading checks it against the n elements of the store's mesh. */
lam_status sky_bounce_save(const sky_bounce *b, store *s, lam_error *error);
lam_status sky_bounce_load(store *s, size_t n, sky_bounce *out, lam_error *error);

/* The north of a store's sky, degrees; 0 where it states none. Errors: LAM_ERR_FORMAT. */
lam_status sky_north_load(store *s, double *north, lam_error *error);

#endif
