/* The light that few bright elements give every other one, pair by pair: what a sample of form factors is too
 * coarse for where elements are many. */
#ifndef LAMBERT_FORMFACTOR_PAIRS_FIRST_LIGHT_H
#define LAMBERT_FORMFACTOR_PAIRS_FIRST_LIGHT_H

#include "solver/scene/mesh.h"

typedef struct first_light first_light;

/* Elements that may shine at once. */
enum { FIRST_LIGHT_MOST = 16384 };

/* The mesh must outlive it. Errors: LAM_ERR_MEMORY, _INTERNAL. */
lam_status first_light_create(const mesh *m, uint64_t seed, first_light **out, lam_error *error);
void first_light_destroy(first_light *l);

/* H = F E, [n]; *known is false, and H as it was, where E is not 0 for more than FIRST_LIGHT_MOST elements.
 * Up to 16 of them are looked at one by one, closely where some of the other is hidden; of more, those that
 * an element gets a good part of its light from, and some of the others for all of them, by the kernel from
 * middle to middle. By all threads, whose number changes nothing. Cost: about 2 us for each of n and of up to
 * 200 bright ones. Errors: LAM_ERR_MEMORY. */
lam_status first_light_of(const first_light *l, const float *E, double *H, bool *known, lam_error *error);

/* The same of a first_light, as judge.h asks for it. */
lam_status first_light_for_judge(void *context, const float *E, double *H, bool *known, lam_error *error);

#endif
