/* The light of a lightmap: each texel gathers at its point, as a sensor does, by a row of its own,
 *     E_s = sum_j weight_sj B_j + sum_t sky_ts L_t + sum_k d_k colour_kc H_ks.
 * Rows are made for a call and not kept: they take some kilobytes for each texel. */
#ifndef LAMBERT_LIGHTMAP_LIGHT_H
#define LAMBERT_LIGHTMAP_LIGHT_H

#include "solver/base/progress.h"
#include "solver/formfactor/sky_bounce.h"
#include "solver/lightmap/lightmap_texels.h"
#include "solver/luminaire/placed.h"
#include "solver/operator/luminaire_light.h"

/* Rays of a texel, and pairs from one LIGHTMAP_PAIRS-th on: on the ceiling of a Cornell box neighbours differ
 * by 1.3 % of noise then for .5 ms; pairs from the share of a ray on leave .9 % for 1.6 ms. */
enum { LIGHTMAP_RAYS = 1024, LIGHTMAP_PAIRS = 64 };

/* One light of a scene, its answer, and its parts that come to texels directly. */
typedef struct lightmap_light {
    size_t n_channels;
    const float *B;        /* [C][n], radiosities under it */
    const float *E;        /* [C][n], of elements that emit; NULL: none do */
    const sky_bounce *sky; /* tiles and ground, beside: */
    const float *L;        /* [C][tiles], radiances; NULL: the sky is dark */
    const placed_luminaires *placed;
    const lam_luminaires *luminaires; /* their colours, beside: */
    const float *D;                   /* [C][luminaires], dimmers; NULL: they are dark */
    bool radiosity;                   /* values are E + rho H of the element at a texel, in place of H */
    uint64_t seed;
} lightmap_light;

typedef struct lightmap {
    size_t width, height, n_channels;
    float *values; /* [height][width][C], the first row on top */
    double mean;   /* of the values that were gathered, by area and over channels */
    double most;   /* the largest of them */
    size_t hidden; /* texels that lie in a body or in a luminaire, which have the light of their neighbours */
} lightmap;

/* Gathers at the texels and fills each chart and its border: a texel without a value gets the mean of its
 * neighbours, those near lit ones first. A texel of whose rays .9 meet backs of faces, or that lies in the
 * opening of a luminaire, has no value of its own. One that no light at all reaches is black but within
 * LIGHTMAP_BORDER texels of lit ones: it is mostly covered by a body, whose rim would be dark. The bits do
 * not depend on threads. Freed by lightmap_free. Cost: 1,024 rays of a sensor for each texel, .5 to 3 ms.
 * Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED, LAM_ERR_INTERNAL. */
lam_status lightmap_make(const mesh *m, const lightmap_charts *c, const lightmap_texels *t,
                         const lightmap_light *light, const progress *steps, lightmap *out, lam_error *error);
void lightmap_free(lightmap *map);

enum { LIGHTMAP_EMPTY, LIGHTMAP_DARK, LIGHTMAP_LIT };

/* Fills the texels of charts and borders as lightmap_make does; state [height][width] is one of the above. A
 * chart without any lit texel stays 0. Errors: LAM_ERR_MEMORY. */
lam_status lightmap_fill(const lightmap_charts *c, uint8_t *state, lightmap *map, lam_error *error);

#endif
