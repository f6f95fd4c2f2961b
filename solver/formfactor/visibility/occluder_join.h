/* Pieces of facets joined into larger convex ones: a wall of a hundred elements blocks as one rectangle. */
#ifndef LAMBERT_FORMFACTOR_VISIBILITY_OCCLUDER_JOIN_H
#define LAMBERT_FORMFACTOR_VISIBILITY_OCCLUDER_JOIN_H

#include "solver/scene/facet/facets.h"

/* Corners of a joined piece at most. */
enum { OCCLUDER_CORNERS = 8 };

/* A convex polygon by vertices of the mesh, counter-clockwise seen from the front. */
typedef struct joined_piece {
    uint32_t corner[OCCLUDER_CORNERS], n;
    uint32_t facet; /* MESH_NO_VERTEX: of several facets, in one plane */
} joined_piece;

/* Joins two pieces of facets at a time that face the same way, lie in one plane, share a whole edge and make
 * a convex polygon, until there are no more of these: first triangles, then the rows of a grid, then rows
 * with each other, and at last unions of more than four corners. A piece of four corners that is not plane
 * and convex is two triangles. Vertices at the same place are one. slack, metres: what deviates less from a
 * line or a plane lies in it. *out [*count] is freed by the caller. Cost: O(n log n). Errors: LAM_ERR_MEMORY.
 */
lam_status occluders_join(const mesh *m, const facets *f, double slack, joined_piece **out, size_t *count,
                          lam_error *error);

#endif
