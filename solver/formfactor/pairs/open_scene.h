/* The proof that nothing in a scene can hide anything, as in a convex room or a bowl seen from inside. */
#ifndef LAMBERT_FORMFACTOR_PAIRS_OPEN_SCENE_H
#define LAMBERT_FORMFACTOR_PAIRS_OPEN_SCENE_H

#include "solver/formfactor/pairs/clusters.h"

/* True where all vertices of elements lie in front of the plane of every element or in it, up to 1e-7 of the
 * extent of the scene: a segment between two points of the scene then ends in front of all planes, and
 * crosses none. t: a tree of the mesh. Cost: a few hundred boxes for each element where the answer is yes,
 * and mostly one element where it is no. */
bool clusters_hide_nothing(const mesh *m, const cluster_tree *t);

/* *out = clusters_hide_nothing, with a tree of its own. Cost: O(n log n) where the answer is yes, and mostly
 * O(n) where it is no. Errors: LAM_ERR_MEMORY. */
lam_status mesh_is_unhidden(const mesh *m, bool *out, lam_error *error);

#endif
