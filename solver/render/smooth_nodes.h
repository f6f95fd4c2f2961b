/* The nodes of surfaces, at which smoothed light is the same for all elements that meet there. */
#ifndef LAMBERT_RENDER_SMOOTH_NODES_H
#define LAMBERT_RENDER_SMOOTH_NODES_H

#include "solver/scene/mesh.h"

/* A node inside an edge of an element: its value is (1 - t) that of node a + t that of node b. */
typedef struct smooth_tie {
    uint32_t a, b;
    uint32_t element; /* that has the edge */
    double t;
    double length; /* of that edge, m; 0: the node is in no edge */
} smooth_tie;

/* A node is a vertex of one surface, elements of one group that meet there at less than 20 degrees. Vertices
 * closer than a millionth of the scene count as one. */
typedef struct smooth_nodes {
    size_t n_nodes;
    uint32_t (*corner)[4]; /* [n]: the node of each corner of an element; the 4th of a triangle is not used */
    uint32_t *vertex;      /* [n_nodes]: a vertex at that place */
    uint32_t *element;     /* [n_nodes]: one of its elements */
    smooth_tie *ties;      /* [n_nodes] */
} smooth_nodes;

/* Cost: O(n log n) where edges meet whole edges or few parts of them. Errors: LAM_ERR_MEMORY. */
lam_status smooth_nodes_create(const mesh *m, smooth_nodes *out, lam_error *error);
void smooth_nodes_free(smooth_nodes *nodes);

#endif
