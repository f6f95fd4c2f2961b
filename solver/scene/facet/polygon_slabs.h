/* A region of the plane, between any number of closed rings, cut into slabs: parallelograms and triangles. */
#ifndef LAMBERT_SCENE_FACET_POLYGON_SLABS_H
#define LAMBERT_SCENE_FACET_POLYGON_SLABS_H

#include "store/status.h"

#include <stdbool.h>
#include <stdint.h>

/* The points corner + x edge[0] + y edge[1] with x and y from 0 to 1, or, of a triangle, with x + y up to 1;
 * edge[1] lies counter-clockwise of edge[0]. */
typedef struct slab_piece {
    double corner[2], edge[2][2];
    bool triangle;
} slab_piece;

/* An edge of a ring, from one point to another. */
typedef struct slab_edge {
    double from[2], to[2];
} slab_edge;

/* The pieces of all that an odd number of rings surround; pieces that are thinner than slack are left out.
 * *pieces [*n] is freed by the caller. Cost: the square of the number of edges. Errors: LAM_ERR_MEMORY. */
lam_status polygon_slabs(size_t n_edges, const slab_edge *edges, double slack, slab_piece **pieces, size_t *n,
                         lam_error *error);

#endif
