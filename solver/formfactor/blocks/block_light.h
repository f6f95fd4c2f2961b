/* Direct illumination by few elements, H = F E, by a walk of the tree of clusters from these elements. It
 * shares nothing with blocks of form factors but the tree and the proofs that nothing, or one occluder all,
 * stands between two nodes: it is as fine as the light needs, down to exact pairs, and has segments of its
 * own. */
#ifndef LAMBERT_FORMFACTOR_BLOCKS_BLOCK_LIGHT_H
#define LAMBERT_FORMFACTOR_BLOCKS_BLOCK_LIGHT_H

#include "solver/operator/blocks/plane_tree.h"
#include "solver/scene/mesh.h"

typedef struct block_light block_light;

/* Mesh and tree must outlive it; accuracy: the bound of the blocks beside it, which segments follow. Errors:
 * LAM_ERR_MEMORY, LAM_ERR_INTERNAL. */
lam_status block_light_create(const mesh *m, const plane_tree *tree, double accuracy, uint64_t seed,
                              block_light **out, lam_error *error);
void block_light_destroy(block_light *l);

/* H = F E, and half the difference D of two independent estimates whose mean H is: the expectation of D^2 is
 * the variance of H. Both [n], in mesh order. Sets *known to false, and leaves both unchanged, where more
 * than a quarter of all elements shines. Open light is off by about 2e-4, partly hidden light is unbiased but
 * for the ratio of half of the segments. The bits do not depend on the number of threads. Cost for a source
 * that is small: clusters in the open, about n^1/2 elements along shadows. Errors: LAM_ERR_MEMORY. */
lam_status block_light_of(const block_light *l, const float *E, double *H, double *D, bool *known,
                          lam_error *error);

#endif
