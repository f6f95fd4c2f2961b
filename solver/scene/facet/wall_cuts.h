/* Faces cut along the walls that stand on them, before they are divided, so that no element lies under a
 * wall. Knows no light. */
#ifndef LAMBERT_SCENE_FACET_WALL_CUTS_H
#define LAMBERT_SCENE_FACET_WALL_CUTS_H

#include "solver/scene/mesh.h"

typedef struct wall_cuts_report {
    size_t faces, parts; /* faces that were cut, and the parts that they became */
    size_t left;         /* edges of walls that are not cut along, as there would be too many faces */
} wall_cuts_report;

/* Cuts the faces of a mesh in place along the edges in which other faces stand on them, or pass through them,
 * by straight lines that end where they meet one made before (Fuchs, Kedem and Naylor 1980), the longest
 * edges first: on faces of a diameter of `least` metres or more, where connected edges extend over as much,
 * and as long as there are no more than `most` faces. Parts have 3 or 4 corners, follow each other in place
 * of their face, and may end in the middle of a neighbour's side. A mesh without walls stays as it is, bit
 * for bit. Cost: O(n log n) and for each face edges times the parts that they cross. Errors:
 * LAM_ERR_ARGUMENT for a mesh with backs, LAM_ERR_MEMORY. */
lam_status faces_cut_at_walls(mesh *m, double least, size_t most, wall_cuts_report *report, lam_error *error);

/* The number of elements that lie under a wall: on both sides of connected edges of other faces that stand on
 * them and extend over at least half of their width. Cost: O(n log n). Errors: LAM_ERR_MEMORY. */
lam_status elements_under_walls(const mesh *m, size_t *n, lam_error *error);

#endif
