/* Pieces of facets joined into larger convex ones: a wall of a hundred elements blocks as one rectangle. */
#ifndef LAMBERT_FORMFACTOR_BLOCKS_OCCLUDER_JOIN_H
#define LAMBERT_FORMFACTOR_BLOCKS_OCCLUDER_JOIN_H

#include "solver/scene/mesh.h"

/* Joins two pieces at a time that face the same way, lie in one plane, share a whole edge and make a triangle
 * or a convex quadrilateral, until there are no more of these: first triangles, then the rows of a grid, then
 * rows with each other. slack, metres: what deviates less from a line or a plane lies in it. pieces [*count]
 * as those of facets.h; they and *count are replaced. Cost: O(n log n). Errors: LAM_ERR_MEMORY. */
lam_status occluders_join(const mesh *m, double slack, uint32_t (*pieces)[4], size_t *count,
                          lam_error *error);

#endif
