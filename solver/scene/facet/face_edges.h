/* The edges of faces, cut where corners of other faces lie on them, so that two faces that meet share whole
 * edges: corners beside each other are one place, and T-junctions are cut. Knows no planes and no light. */
#ifndef LAMBERT_SCENE_FACET_FACE_EDGES_H
#define LAMBERT_SCENE_FACET_FACE_EDGES_H

#include "solver/scene/mesh.h"

/* A face on an edge, and how it runs along it. */
typedef struct edge_face {
    uint32_t face;
    bool forward; /* from the lower to the higher place, counter-clockwise seen from the front of the face */
} edge_face;

typedef struct face_edges {
    size_t n_places; /* the vertices of the mesh, of which only the first at each place is used */
    uint32_t *place; /* [n_places] */
    size_t n;
    uint32_t (*ends)[2]; /* [n], two places, ascending */
    size_t *first;       /* [n + 1]: edge e belongs to faces[first[e]] ... faces[first[e + 1] - 1] */
    edge_face *faces;    /* [first[n]] */
    size_t *first_at;    /* [n_places + 1]: the edges at place p are at[first_at[p]] ... */
    uint32_t *at;        /* [2 n] */
} face_edges;

/* The edges of faces 0 ... n_faces-1. Vertices no further than slack metres from each other are one place,
 * and an edge is cut at each place no further than slack from it. Edges that both ends of lie at one place
 * are left out. Freed by face_edges_free. Cost: O(n log n) where places are spread over surfaces. Errors:
 * LAM_ERR_MEMORY. */
lam_status face_edges_find(const mesh *m, size_t n_faces, double slack, face_edges *out, lam_error *error);
void face_edges_free(face_edges *e);

#endif
