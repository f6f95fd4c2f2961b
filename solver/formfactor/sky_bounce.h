/* What every element receives directly from each tile of a sky: bins that rays fill, and what they become. */
#ifndef LAMBERT_FORMFACTOR_SKY_BOUNCE_H
#define LAMBERT_FORMFACTOR_SKY_BOUNCE_H

#include "solver/daylight/sky_tiles.h"
#include "store/store.h"

/* All zero: no sky. */
typedef struct sky_bounce {
    sky_tiling tiling;
    double ground_albedo;
    size_t n;
    float *first_bounce; /* [m][n], sr: pi F_i,tile, so that H0 = first_bounce^T L; while it is found, the
                            shares of what leaves an element */
    double *ground;      /* [n], share that goes below the horizon; NULL once it is found */
} sky_bounce;

/* Empty bins for n elements under a tiling (see sky_tiling_create); a ground of albedo 0 to 1.
 * Errors: LAM_ERR_ARGUMENT, LAM_ERR_MEMORY. */
lam_status sky_bounce_create(const char *tiling, char up, double ground_albedo, size_t n, sky_bounce *out,
                             lam_error *error);
void sky_bounce_free(sky_bounce *s);

/* Of a packet those rays that leave the scene: each one's weight goes to its tile's of sums, [m + 1]. */
void sky_bounce_add(const sky_bounce *s, const float direction[3][SKY_PACKET], unsigned leaving,
                    const double weight[SKY_PACKET], double *sums);

/* Takes what one element has found: sums, [m + 1], its weight on each tile and on the ground, of the whole of
 * what it sends out; zeroes them. Any threads at once, each element once. */
void sky_bounce_put(sky_bounce *s, size_t element, double *sums, double whole);

/* Shares become first_bounce: those of element i are scaled by scale[i], what meets the ground is put back on
 * the tiles that light it. */
void sky_bounce_close(sky_bounce *s, const double *scale);

/* /sky of a store. Loading checks it against the n elements of the store's mesh. */
lam_status sky_bounce_save(const sky_bounce *b, store *s, lam_error *error);
lam_status sky_bounce_load(store *s, size_t n, sky_bounce *out, lam_error *error);

#endif
