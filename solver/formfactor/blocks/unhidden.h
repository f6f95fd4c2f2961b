/* The proof that nothing in a scene can hide anything, as in a convex room or a bowl seen from inside. */
#ifndef LAMBERT_FORMFACTOR_BLOCKS_UNHIDDEN_H
#define LAMBERT_FORMFACTOR_BLOCKS_UNHIDDEN_H

#include "solver/operator/blocks/plane_tree.h"
#include "solver/scene/mesh.h"

/* *out = true where all vertices of the mesh lie in front of the plane of every element or in it, up to 1e-7
 * of the extent of the scene: a segment between two points of the scene then ends in front of all planes, and
 * crosses none. tree: of the mesh. Cost: a few hundred boxes for each element where the answer is yes, and
 * mostly one element where it is no. Errors: LAM_ERR_MEMORY. */
lam_status mesh_is_unhidden(const mesh *m, const plane_tree *tree, bool *out, lam_error *error);

/* The row sums of F [n], without any sampling, of a scene for which mesh_is_unhidden is true: by Lambert's
 * formula (1760) for what a point p with normal n sees of all other elements,
 *     1 - 1/(2 pi) sum over edges e of the boundary of theta_e n . (x_e x y_e) / |x_e x y_e|,
 * where x_e, y_e lead from p to the ends of e and theta_e is the angle between them: the edges of neighbours
 * cancel, and those of the element itself add up to the 1. At the centroid of an element, near the boundary
 * at points of its parts. *known is set to false, and nothing else, where the boundary has too many edges to
 * be worth it, as where elements share no vertices. Cost: n times the edges of the boundary. Errors:
 * LAM_ERR_MEMORY. */
lam_status unhidden_row_sums(const mesh *m, bool *known, double *sums, lam_error *error);

#endif
