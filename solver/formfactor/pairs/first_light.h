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

/* H = F E, and half the difference D of two independent estimates whose mean H is: the expectation of D^2 is
 * the variance of H. Both [n]; sets *known to false and leaves them unchanged where E is not 0 for more than
 * FIRST_LIGHT_MOST elements. Visible shares come from 8 to 256 segments a pair, half of them for each
 * estimate. Of more than 16 bright elements each receiver has those that give it at least 1/64 of its
 * unoccluded light one by one, and of the others two samples drawn in proportion to that light. The same for
 * any number of threads. Cost: about 2 us for each of n and of up to 192 bright elements. Errors:
 * LAM_ERR_MEMORY. */
lam_status first_light_of(const first_light *l, const float *E, double *H, double *D, bool *known,
                          lam_error *error);

/* first_light_of in the signature of judge.h; context is a first_light. */
lam_status first_light_for_judge(void *context, const float *E, double *H, double *D, bool *known,
                                 lam_error *error);

#endif
