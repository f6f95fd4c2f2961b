/* A binary tree of clusters over the elements of a mesh. Elements in one plane are parted where walls stand
 * on it, and halved across their longer side down to a few elements a leaf; above, planes are joined by
 * position and normal, and last of all parts of the scene that exchange no light. */
#ifndef LAMBERT_OPERATOR_BLOCKS_PLANE_TREE_H
#define LAMBERT_OPERATOR_BLOCKS_PLANE_TREE_H

#include "lambert/lambert.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Coordinates in a plane: (p - origin) . axis. */
typedef struct plane_frame {
    double origin[3], axis[2][3];
} plane_frame;

/* Positions [begin, end). Children stand before their parent, the right one directly before it. */
typedef struct plane_cluster {
    uint32_t begin, end, left;
    bool leaf, apart; /* apart: its children are of different parts of the scene */
    uint32_t frame;   /* the frame of its plane; PLANE_ABOVE: several planes */
} plane_cluster;

#define PLANE_ABOVE UINT32_MAX

/* Elements of a leaf at most, in the trees of multiwavelets and of the blocks that go into them. */
enum { PLANE_LEAF = 6 };

/* A fact about the mesh of a tree: elements may hide something of each other, or nothing. */
typedef enum plane_view { PLANE_VIEW_UNKNOWN, PLANE_VIEW_HIDDEN, PLANE_VIEW_UNHIDDEN } plane_view;

typedef struct plane_tree {
    size_t n, n_clusters, n_frames;
    size_t n_alone;          /* elements of UNION_FIND_ALONE, the last positions; 0 of a tree from a store */
    uint32_t *order;         /* [n], position -> element */
    plane_cluster *clusters; /* [n_clusters], postorder */
    plane_frame *frames;     /* [n_frames] */
    plane_view view;         /* unknown until someone who knows the mesh says it */
} plane_tree;

/* The corners of elements. */
typedef struct element_corners {
    const double (*vertices)[3]; /* m */
    const uint32_t (
        *elements)[4]; /* [n] below the number of vertices; the fourth of a triangle: UINT32_MAX */
} element_corners;

void plane_tree_free(plane_tree *tree);

/* centre [n], unit normal [n]; a leaf has at most leaf_most elements. corners NULL: walls are not looked for.
 * part [n]: clusters that are not apart have elements of one number; NULL: all are of one part. Elements of
 * UNION_FIND_ALONE, which exchange light with no other one, stand at the end and are one part in that.
 * Deterministic. Cost: O(n log n). Errors: LAM_ERR_MEMORY. */
lam_status plane_tree_make(size_t n, const double (*centre)[3], const float (*normal)[3],
                           const element_corners *corners, const uint32_t *part, size_t leaf_most,
                           plane_tree *out, lam_error *error);

#endif
