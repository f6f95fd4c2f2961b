/* A binary tree of clusters over the elements of a mesh, split by place and by direction of the normals. */
#ifndef LAMBERT_FORMFACTOR_CLUSTERS_CLUSTERS_H
#define LAMBERT_FORMFACTOR_CLUSTERS_CLUSTERS_H

#include "solver/scene/mesh.h"

/* The elements at positions first ... last-1 of the tree's order, and their bounding box. */
typedef struct cluster {
    uint32_t first, last;
    uint32_t child[2]; /* 0: none, it is a leaf (cluster 0 is the root) */
    double low[3], high[3];
    double normal[3]; /* the mean of all normals, unit */
    double spread;    /* largest angle between that and a normal, radians */
    bool plane;       /* all elements lie in one plane and face one way: normal . x = level */
    double level;
    double largest; /* area of the largest element */
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

/* Halves the longest extent, of centroids or of normals, until leaves are small. slack is the distance by
 * which rounding may move a point off a plane. Cost: O(n log n). Freed by cluster_tree_free. Errors:
 * LAM_ERR_MEMORY. */
lam_status cluster_tree_build(const mesh *m, double slack, cluster_tree *out, lam_error *error);
void cluster_tree_free(cluster_tree *t);

static inline bool cluster_is_leaf(const cluster *c) {
    return c->child[0] == 0;
}

/* True where no element of one faces any of the other, by their planes or by the cones of their normals. */
bool cluster_faces_away(const cluster *a, const cluster *b, double slack);

/* Smallest distance between points of two boxes, squared. */
double cluster_distance2(const cluster *a, const cluster *b);

#endif
