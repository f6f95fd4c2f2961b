/* A binary tree of clusters over the elements of a mesh: what lies together and faces one way is together. */
#ifndef LAMBERT_FORMFACTOR_PAIRS_CLUSTERS_H
#define LAMBERT_FORMFACTOR_PAIRS_CLUSTERS_H

#include "solver/scene/mesh.h"

/* Positions first ... last-1 of the tree's order, in a box. */
typedef struct cluster {
    uint32_t first, last;
    uint32_t child[2]; /* 0: none, it is a leaf (cluster 0 is the root) */
    double low[3], high[3];
    double normal[3]; /* the middle of all normals */
    double spread;    /* largest angle between that and a normal, radians */
    bool plane;       /* all of it lies in one plane and faces one way: normal . x = level */
    double level;
    double largest; /* area of an element */
    double area;
} cluster;

typedef struct cluster_tree {
    size_t n, n_clusters;
    cluster *clusters;  /* parents before children */
    uint32_t *element;  /* [n], of a position */
    uint32_t *position; /* [n], of an element */
} cluster_tree;

/* Elements of a leaf at most. */
enum { CLUSTER_LEAF = 4 };

/* Halves the longest extent, of places or of directions, until leaves are small. slack is what rounding may
 * move a point off a plane. Cost: O(n log n). Freed by cluster_tree_free. */
lam_status cluster_tree_build(const mesh *m, double slack, cluster_tree *out, lam_error *error);
void cluster_tree_free(cluster_tree *t);

static inline bool cluster_is_leaf(const cluster *c) {
    return c->child[0] == 0;
}

/* Whether no element of one can see any of the other, by their planes or their normals. */
bool cluster_faces_away(const cluster *a, const cluster *b, double slack);

/* Smallest distance between points of two boxes, squared. */
double cluster_distance2(const cluster *a, const cluster *b);

#endif
