/* The proof that nothing in a scene can hide anything, as in a convex room or a bowl seen from inside. */
#ifndef LAMBERT_FORMFACTOR_SIGHT_OPEN_SCENE_H
#define LAMBERT_FORMFACTOR_SIGHT_OPEN_SCENE_H

#include "solver/formfactor/clusters/clusters.h"

/* True where all vertices of elements lie in front of the plane of every element or in it, up to 1e-7 of the
 * extent of the scene: a segment between two points of the scene then ends in front of all planes, and
 * crosses none. t: a tree of the mesh. Cost: a few hundred boxes for each element where the answer is yes,
 * and mostly one element where it is no. */
bool clusters_hide_nothing(const mesh *m, const cluster_tree *t);

/* The light that dents may hide, of the light that leaves an element and of that of all elements together. */
#define OPEN_SCENE_ROW_MOST 1e-3
#define OPEN_SCENE_MEAN_MOST 2e-5

/* True where clusters_hide_nothing would be but for dents that hide next to nothing, as those between rings
 * of unequal numbers of vertices. A segment that element Z blocks leaves, at one of its ends, a point behind
 * Z's plane towards the back of Z. So with H_Y the sum over Z of the unoccluded factors from Y to the back of
 * Z, at most 2 sum A H of the light sum A is hidden. In a closed surface H_Y is all that is hidden of row
 * Y: of the elements that a ray crosses beyond its first one as many show their front as their back. *out:
 * nothing is behind a plane by more than a hundredth of the extent, each H_Y is at most OPEN_SCENE_ROW_MOST,
 * and sum A H / sum A at most OPEN_SCENE_MEAN_MOST. hidden, unless NULL, gets sum A H / sum A where *out is
 * true. Cost: O(n log n) where the answer is yes, and mostly O(n) where it is no. Errors: LAM_ERR_MEMORY. */
lam_status mesh_is_unhidden(const mesh *m, bool *out, double *hidden, lam_error *error);

#endif
