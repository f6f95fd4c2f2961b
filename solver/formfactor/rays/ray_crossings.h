/* The work of casting rays in a scene, counted on a sample of them without a clock. */
#ifndef LAMBERT_FORMFACTOR_RAYS_RAY_CROSSINGS_H
#define LAMBERT_FORMFACTOR_RAYS_RAY_CROSSINGS_H

#include "solver/scene/mesh.h"

/* Means over rays with a cosine distribution from random elements. boxes: bounding boxes of triangles that a
 * ray crosses until it hits something, those of its own element and of the one it hits among them (a quad is
 * two); hits: the share of rays that hit anything. */
typedef struct ray_crossings {
    double boxes, hits;
} ray_crossings;

/* Each of up to 256 rays is compared with all elements, of large scenes fewer rays. The same for any number
 * of threads. Cost: 2^24 comparisons, or 32 n. Errors: LAM_ERR_MEMORY. */
lam_status ray_crossings_sample(const mesh *m, uint64_t seed, ray_crossings *out, lam_error *error);

#endif
