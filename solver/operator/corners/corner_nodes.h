/* The corners of a mesh that its elements share: nodes of surfaces, at which light is the same for all
 * elements that meet there. Owns welding, creases and T-junctions; knows no light. */
#ifndef LAMBERT_OPERATOR_CORNERS_CORNER_NODES_H
#define LAMBERT_OPERATOR_CORNERS_CORNER_NODES_H

#include "store/status.h"

#include <stdbool.h>
#include <stdint.h>

#define CORNER_NONE 0xFFFFFFFFu

/* A mesh as it is stored (store/FORMAT.md, /mesh); borrowed. Every index is below its bound. */
typedef struct corner_mesh {
    size_t n_vertices, n;
    const double (*vertices)[3];   /* [n_vertices], m */
    const uint32_t (*elements)[4]; /* [n]; CORNER_NONE as the 4th vertex of a triangle */
    const float (*normal)[3];      /* [n] */
    const uint32_t *group;         /* [n] */
    const bool *buried;            /* [n]: between a body and the face that it stands on; NULL: none */
} corner_mesh;

static inline size_t corner_mesh_count(const corner_mesh *m, size_t element) {
    return m->elements[element][3] == CORNER_NONE ? 3 : 4;
}

/* A node inside an edge of an element: its value is (1 - t) that of node a + t that of node b. */
typedef struct corner_tie {
    uint32_t a, b;
    double t;
    double length; /* of that edge, m; 0: the node is in no edge */
} corner_tie;

/* A node is a vertex of one surface, elements of one group that meet there at less than 20 degrees, none or
 * all of them buried. Vertices closer than a millionth of the scene count as one. Where a corner of another
 * surface lies inside an edge of an element that no other shares, the element has a node of its own there.
 * Nodes ascend by group, within one by the first element that has them. */
typedef struct corner_nodes {
    size_t n_nodes;
    uint32_t (
        *corner)[4];   /* [n]: the node of each corner of an element; of a triangle CORNER_NONE is the 4th */
    uint32_t *vertex;  /* [n_nodes]: a vertex at that place */
    uint32_t *element; /* [n_nodes]: the first of its elements */
    corner_tie *ties;  /* [n_nodes]: the longest edge that the node is inside of */
    /* The polygon of element i: its corners and the nodes inside its edges, counter-clockwise, are
     * ring[ring_start[i]] ... ring[ring_start[i + 1] - 1]; inside[k]: ring[k] is within an edge. */
    size_t *ring_start;
    uint32_t *ring;
    bool *inside;
} corner_nodes;

/* Cost: O(n log n) where edges meet whole edges or few parts of them. Errors: LAM_ERR_MEMORY. */
lam_status corner_nodes_create(const corner_mesh *m, corner_nodes *out, lam_error *error);
void corner_nodes_free(corner_nodes *nodes);

/* Elements at less than this angle are one surface: the cosine of 20 degrees. Buried ones are dark, and no
 * part of what is seen around them. */
static inline bool corner_same_surface(const corner_mesh *m, uint32_t i, uint32_t j) {
    const float *a = m->normal[i], *b = m->normal[j];
    return m->group[i] == m->group[j] && (m->buried == NULL || m->buried[i] == m->buried[j]) &&
           (double)(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) > 0.93969262;
}

#endif
