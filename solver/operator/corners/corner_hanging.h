/* T-junctions, or hanging corners: where elements of different sizes meet, the corner of a small one lies
 * inside an edge of a large one. */
#ifndef LAMBERT_OPERATOR_CORNERS_CORNER_HANGING_H
#define LAMBERT_OPERATOR_CORNERS_CORNER_HANGING_H

#include "solver/operator/corners/corner_nodes.h"

/* The nodes of elements' corners, by ascending welded vertex. */
typedef struct corner_draft {
    const corner_mesh *m;
    double tolerance; /* m: closer points are one */
    size_t n_nodes;
    uint32_t (*corner)[4]; /* [n] */
    uint32_t *vertex;      /* [n_nodes], welded */
    uint32_t *element;     /* [n_nodes] */
} corner_draft;

/* A corner inside an edge. */
typedef struct corner_inside {
    uint32_t element, edge; /* the edge begins at this corner of the element */
    uint32_t vertex;        /* welded */
    uint32_t node; /* of the element's surface; CORNER_NONE: other surfaces alone have a corner there */
    double t;      /* 0 to 1 along the edge */
    double length; /* of the edge, m */
} corner_inside;

/* *out [*count], by element, edge and t, freed by the caller. Only edges that one element of a surface has
 * alone are looked at, and only the ends of such edges hang. Meshes in which one edge holds more corners than
 * INSIDE_MOST times the elements keep cracks. Cost: O(n log n) where edges meet whole edges or few parts of
 * them. Errors: LAM_ERR_MEMORY. */
#define INSIDE_MOST 4
lam_status corner_hanging_find(const corner_draft *draft, corner_inside **out, size_t *count,
                               lam_error *error);

#endif
