/* Large convex polygons, joined from the pieces of facets that lie in one plane (Hertel and Mehlhorn 1983).
 */
#ifndef LAMBERT_FORMFACTOR_PAIRS_PLANE_JOINS_H
#define LAMBERT_FORMFACTOR_PAIRS_PLANE_JOINS_H

#include "solver/scene/facet/facets.h"

/* Corners of a joined polygon at most. */
enum { JOINED_CORNERS = 8 };

typedef struct joined_polygon {
    int n;
    double corner[JOINED_CORNERS][3]; /* counter-clockwise seen from the front */
    uint32_t facet;                   /* MESH_NO_VERTEX: of several facets, in one plane */
} joined_polygon;

typedef struct plane_joins {
    size_t n;
    joined_polygon *of; /* [n] */
} plane_joins;

/* Joins two pieces across an edge that they share while the union is plane and convex, the longest edges
 * first. A corner within slack metres of a straight line is dropped. Cost: O(n log n). Freed by
 * plane_joins_free. Errors: LAM_ERR_MEMORY. */
lam_status plane_joins_make(const mesh *m, const facets *f, double slack, plane_joins *out, lam_error *error);
void plane_joins_free(plane_joins *j);

#endif
