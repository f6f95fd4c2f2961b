/* Occluders of a scene: large convex polygons, joined from the pieces of its facets, in a tree of boxes. A
 * room has a few dozens, however finely it is divided. Knows no light. */
#ifndef LAMBERT_FORMFACTOR_PAIRS_JOINED_OCCLUDERS_H
#define LAMBERT_FORMFACTOR_PAIRS_JOINED_OCCLUDERS_H

#include "solver/formfactor/pairs/plane_joins.h"
#include "solver/formfactor/pairs/shaft.h"

enum { OCCLUDER_CORNERS = JOINED_CORNERS };

/* A planar convex polygon that hides from both sides. */
typedef struct joined_occluder {
    int n;
    double corner[OCCLUDER_CORNERS][3]; /* counter-clockwise about the normal */
    double normal[3], level;            /* unit; normal . x = level */
    double edge[OCCLUDER_CORNERS][4];   /* edge . (x, 1): distance of x in the plane, inwards, metres */
    double low[3], high[3];
    uint32_t facet; /* MESH_NO_VERTEX: of several, in one plane */
} joined_occluder;

/* first: of children first, first + 1 (count 0), or of count entries of list. */
typedef struct occluder_node {
    double low[3], high[3];
    uint32_t first, count;
} occluder_node;

typedef struct joined_occluders {
    size_t n, n_nodes;
    joined_occluder *of; /* [n] */
    uint32_t *list;      /* [n], sorted by node */
    occluder_node *nodes;
    double slack; /* metres: rounding may move a point by that much */
} joined_occluders;

/* The joined polygons (plane_joins.h) of all facets. Of two with the same corners one is kept, and those
 * thinner than slack are left out. Cost: O(n log n). Freed by joined_occluders_free. Errors: LAM_ERR_MEMORY.
 */
lam_status joined_occluders_make(const mesh *m, const facets *f, double slack, joined_occluders *out,
                                 lam_error *error);
void joined_occluders_free(joined_occluders *o);

/* Occluders that may stand between two clusters; count: or OCCLUDERS_UNCOUNTED, where there are more. */
enum { LINK_OCCLUDERS_MOST = 48, OCCLUDERS_UNCOUNTED = -1 };
typedef struct link_occluders {
    int count;
    uint32_t of[LINK_OCCLUDERS_MOST];
} link_occluders;

/* Finds the occluders that reach into the shaft s of a and b and have points of both on different sides.
 * Count 0 proves that nothing is between them. */
void joined_occluders_between(const joined_occluders *o, const shaft *s, const cluster *a, const cluster *b,
                              link_occluders *out);

/* True where one of those covers each of the clusters from the other. */
bool joined_occluders_hide(const joined_occluders *o, const link_occluders *among, const cluster *a,
                           const cluster *b);

#endif
