/* Scenes in which nothing can hide anything (open_scene.h): trees that know it, and row sums without samples.
 */
#ifndef LAMBERT_FORMFACTOR_BLOCKS_UNHIDDEN_H
#define LAMBERT_FORMFACTOR_BLOCKS_UNHIDDEN_H

#include "solver/operator/blocks/plane_tree.h"
#include "solver/scene/mesh.h"

/* Sets view of a tree of the mesh whose planes are not large enough for blocks of their own
 * (blocks_are_planar), by mesh_is_unhidden, so that all who need to know share one proof. Errors:
 * LAM_ERR_MEMORY. */
lam_status plane_tree_look(const mesh *m, plane_tree *tree, lam_error *error);

/* The row sums of F [n], without any sampling, of a scene in which nothing hides anything: by Lambert's
 * formula (1760) for what a point p with normal n sees of all other elements,
 *     1 - 1/(2 pi) sum over edges e of the boundary of theta_e n . (x_e x y_e) / |x_e x y_e|,
 * where x_e, y_e lead from p to the ends of e and theta_e is the angle between them: the edges of neighbours
 * cancel, and those of the element itself add up to the 1. At the centroid of an element, near the boundary
 * at points of its parts. *known is set to false, and nothing else, where the boundary has too many edges to
 * be worth it, as where elements share no vertices. Cost: n times the edges of the boundary. Errors:
 * LAM_ERR_MEMORY. */
lam_status unhidden_row_sums(const mesh *m, bool *known, double *sums, lam_error *error);

#endif
