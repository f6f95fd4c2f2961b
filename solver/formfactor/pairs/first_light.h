/* Direct illumination by few bright elements, H = F E pair by pair: a reference for emissions whose first
 * bounce a sampled F gets wrong, because its noise per entry grows with n. */
#ifndef LAMBERT_FORMFACTOR_PAIRS_FIRST_LIGHT_H
#define LAMBERT_FORMFACTOR_PAIRS_FIRST_LIGHT_H

#include "solver/scene/mesh.h"

typedef struct first_light first_light;

/* The most elements with E != 0. */
enum { FIRST_LIGHT_MOST = 16384 };

/* The mesh must outlive it. Errors: LAM_ERR_MEMORY, _INTERNAL. */
lam_status first_light_create(const mesh *m, uint64_t seed, first_light **out, lam_error *error);
void first_light_destroy(first_light *l);

/* H = F E, [n]; sets *known to false and leaves H unchanged where E is not 0 for more than FIRST_LIGHT_MOST
 * elements. Up to 16 bright elements: each pair by occlusion_test, mixed ones by occlusion_estimate. More:
 * for each receiver the bright elements that give it at least 1/96 of its unoccluded light one by one, and of
 * the others a sample drawn in proportion to that light, estimated by the kernel between centroids. The same
 * for any number of threads. Cost: about 2 us for each of n and of up to 200 bright elements. Errors:
 * LAM_ERR_MEMORY. */
lam_status first_light_of(const first_light *l, const float *E, double *H, bool *known, lam_error *error);

/* first_light_of in the signature of judge.h; context is a first_light. */
lam_status first_light_for_judge(void *context, const float *E, double *H, bool *known, lam_error *error);

#endif
