/* Occluders of a scene: large convex polygons, joined from the pieces of its facets, in a tree of boxes. A
 * room has a few dozens, however finely it is divided. Knows no light. */
#ifndef LAMBERT_FORMFACTOR_VISIBILITY_OCCLUDERS_H
#define LAMBERT_FORMFACTOR_VISIBILITY_OCCLUDERS_H

#include "solver/formfactor/visibility/shaft.h"
#include "solver/scene/facet/facets.h"
#include "solver/scene/facet/polygon_join.h"

/* Corners of an occluder at most. */
enum { OCCLUDER_CORNERS = JOINED_CORNERS };

/* A planar convex polygon that hides from both sides, unless it is of a pane: a point x of its plane is
 * inside where edge[e] . (x, 1) >= 0 for all. */
typedef struct occluder {
    double low[3], high[3], normal[3], level; /* unit; normal . x = level */
    double middle[3], radius;                 /* of a sphere about all corners */
    int n;
    uint32_t facet;                     /* MESH_NO_VERTEX: of several, in one plane */
    uint32_t set;                       /* of facets that lie in one plane (occluders.set_of_facet) */
    uint32_t pane;                      /* an element of the pane; MESH_NO_VERTEX: it is opaque */
    double edge[OCCLUDER_CORNERS][4];   /* the distance of x from the edge, inwards, metres */
    double across[4][OCCLUDER_CORNERS]; /* the edges by component, repeated to fill */
    double corner[OCCLUDER_CORNERS][3]; /* counter-clockwise about the normal */
} occluder;

/* first: of children first, first + 1 (count 0), or of count entries of list. */
typedef struct occluder_node {
    double low[3], high[3];
    uint32_t first, count;
} occluder_node;

typedef struct occluders {
    size_t n, n_nodes;
    occluder *of;   /* [n] */
    uint32_t *list; /* [n], in the order of the nodes */
    occluder_node *nodes;
    uint32_t *set_of_facet; /* [n_facets], below n_facets: facets that were joined have one */
    size_t n_facets;
    double slack;      /* metres: rounding may move a point by that much */
    const mesh *glass; /* whose panes some occluders are; NULL: all are opaque */
} occluders;

/* The joined pieces (polygon_join.h) of all facets, those of a pane apart. Of two with the same corners one
 * is kept, an opaque one before a pane, and those thinner than slack are left out. The mesh must outlive it.
 * Cost: O(n log n). Freed by occluders_free. Errors: LAM_ERR_MEMORY. */
lam_status occluders_make(const mesh *m, const facets *f, double slack, occluders *out, lam_error *error);
void occluders_free(occluders *o);

/* A search of the tree for the occluders that may reach into a shaft. Both must outlive it. Cost: O(log n +
 * found). */
typedef struct occluder_search {
    const occluders *all;
    const shaft *within;
    uint32_t stack[64]; /* twice as many as the halvings of 2^32 occluders */
    int depth;
} occluder_search;
occluder_search occluder_search_begin(const occluders *o, const shaft *within);

/* The next few of them: *count entries of *found; false: there are no more. */
bool occluder_search_next(occluder_search *s, const uint32_t **found, uint32_t *count);

#endif
