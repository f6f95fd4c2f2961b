/* Rectangles about the clusters of elements of one plane, and about single elements: the geometry that form
 * factors by blocks are found with. Nodes are numbered as in block_factors.h: clusters, then elements by
 * position. */
#ifndef LAMBERT_FORMFACTOR_BLOCKS_FLAT_CLUSTERS_H
#define LAMBERT_FORMFACTOR_BLOCKS_FLAT_CLUSTERS_H

#include "solver/formfactor/exchange/polygon.h"
#include "solver/formfactor/visibility/occluders.h"
#include "solver/formfactor/visibility/visibility.h"
#include "solver/operator/blocks/block_factors.h"

/* A plane through its origin. Coordinates in it are (x - origin) . axis, a height is normal . x. The elements
 * of a plane may differ in height: walls of two houses that stand nearly in a row. */
typedef struct flat_plane {
    double origin[3], axis[2][3], normal[3];
} flat_plane;

typedef struct flat_cluster {
    double centre[3], half[2]; /* of the rectangle, along the axes of its plane; radius: half its diagonal */
    double radius, area;       /* area: that of its elements */
    /* Heights: that of the rectangle, how far the corners of its elements are from it at most, and the lowest
     * one of the highest corners of each element. 0 above planes. */
    double level, rise, lowest_top;
    double contact;      /* of an element or any of them, visibility_rise; lowest_top has it in it */
    uint32_t plane;      /* PLANE_ABOVE: several planes. Centre and radius are those of a box then */
    uint32_t set;        /* of facets (occluders.h) that all of its elements lie in, or FLAT_MIXED */
    uint32_t begin, end; /* positions */
    bool full;           /* the elements fill the rectangle at its height; false above planes */
} flat_cluster;

#define FLAT_MIXED MESH_NO_VERTEX

typedef struct flat_clusters {
    const mesh *m;
    const block_factors *tree;
    flat_cluster *of; /* [n_clusters + n] */
    flat_plane *planes;
    size_t n_planes;
    double *before;           /* [n + 1], the area of all elements before a position */
    uint32_t (*set_range)[2]; /* [facets]: the first and the last position of elements of a set, or NULL */
    double slack;             /* metres: less than this is no distance */
    double flush; /* metres: elements of a plane that differ in height by less hide nothing of each other */
} flat_clusters;

/* Measures all nodes, and widens nodes of blocks from the rectangles of centroids to those of the elements.
 * mesh and blocks must outlive out. Cost: O(n log n). Errors: LAM_ERR_MEMORY. */
lam_status flat_clusters_make(const mesh *m, const visibility *v, const plane_tree *tree,
                              block_factors *blocks, flat_clusters *out, lam_error *error);
void flat_clusters_free(flat_clusters *f);

/* Finds the sets of facets of all nodes; without it nodes are of no one. Errors: LAM_ERR_MEMORY. */
lam_status flat_clusters_find_sets(const visibility *v, const plane_tree *tree, const occluders *o,
                                   flat_clusters *f, lam_error *error);

/* The corners of two rectangles side by side, the first's before the second's. */
enum { FLAT_CORNERS = 8 };
typedef struct flat_pair {
    double x[3][FLAT_CORNERS];
} flat_pair;
void flat_clusters_pair(const flat_clusters *f, uint32_t a, uint32_t b, flat_pair *out);

/* The point at (u, v) in [-1, 1]^2 of the rectangle. */
void flat_cluster_point(const flat_clusters *f, uint32_t node, double u, double v, double point[3]);

/* The distance of a point from the rectangle. */
double flat_cluster_distance(const flat_clusters *f, uint32_t node, const double point[3]);

/* A point that is uniform over the area of the elements for (u, v) uniform in the unit square; its place in
 * the rectangle, in [-1, 1]^2 (0 above planes), and the position of its element. */
uint32_t flat_cluster_sample(const flat_clusters *f, uint32_t node, double u, double v, double place[2],
                             double point[3]);

#endif
