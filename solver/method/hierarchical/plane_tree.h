/* A binary tree of clusters over the elements of any mesh: planes first, halved along their longer side down
 * to a few elements; planes are joined by where they are and where they face. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_PLANE_TREE_H
#define LAMBERT_METHOD_HIERARCHICAL_PLANE_TREE_H

#include "lambert/lambert.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Where on a plane: (p - origin) . axis. */
typedef struct plane_frame {
    double origin[3], axis[2][3];
} plane_frame;

/* Positions [begin, end). A node of children has them before it, the right one next to it. */
typedef struct plane_cluster {
    uint32_t begin, end, left;
    bool leaf;
    uint32_t frame; /* of its plane; PLANE_ABOVE: it has several */
} plane_cluster;

#define PLANE_ABOVE UINT32_MAX

typedef struct plane_tree {
    size_t n, n_clusters, n_frames;
    uint32_t *order;         /* [n], position -> element */
    plane_cluster *clusters; /* [n_clusters], postorder */
    plane_frame *frames;     /* [n_frames] */
} plane_tree;

void plane_tree_free(plane_tree *tree);

/* centre [n], normal [n] unit; leaves have at most leaf_most elements. The same for the same mesh. Cost:
 * O(n log n). Errors: LAM_ERR_MEMORY. */
lam_status plane_tree_make(size_t n, const double (*centre)[3], const float (*normal)[3], size_t leaf_most,
                           plane_tree *out, lam_error *error);

#endif
