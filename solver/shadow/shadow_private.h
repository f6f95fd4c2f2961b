/* The inside of a shadow tree, private to shadow*.c. */
#ifndef LAMBERT_SHADOW_SHADOW_PRIVATE_H
#define LAMBERT_SHADOW_SHADOW_PRIVATE_H

#include "solver/shadow/shadow_tree.h"

/* Children of a node; triangles of a leaf, at most. */
enum { SHADOW_WIDTH = 8, SHADOW_LEAF = 4 };

/* Nodes below which halves are even by number, so that no tree is deeper than SHADOW_LEVELS: 2^33 triangles
 * take 11 levels of eight. */
enum { SHADOW_UNEVEN = 16, SHADOW_LEVELS = SHADOW_UNEVEN + 16, SHADOW_STACK = SHADOW_LEVELS * SHADOW_WIDTH };

/* Boxes of the children, relative to the middle of the scene. */
typedef struct shadow_node {
    float low[3][SHADOW_WIDTH], high[3][SHADOW_WIDTH];
    uint32_t child[SHADOW_WIDTH]; /* a node, or the first triangle of a leaf */
    uint8_t count[SHADOW_WIDTH];  /* triangles of a leaf; 0: a node */
} shadow_node;

/* Panes, in a tree of their own: its corners, normals and shapes are those of the scene's. */
typedef struct shadow_panes {
    struct shadow_tree *tree;
    struct group_glass *glass; /* [n], of each element */
    bool by_angle;
} shadow_panes;

struct shadow_tree {
    size_t n, n_pieces, n_nodes;
    double middle[3];       /* of the scene */
    float rounding;         /* m: 4 roundings of single precision of a point of the scene */
    float (*corners)[4][3]; /* [n]; a triangle has its third corner twice */
    float (*normal)[3];     /* [n] */
    uint8_t *shape;         /* [n], a shadow_shape */
    uint32_t *pieces;       /* [n_pieces], leaf by leaf: twice the element, and 1 for a quad's second half */
    shadow_node *nodes;     /* [n_nodes] */
    bool *is_pane;          /* [n]; NULL: there are none */
    shadow_panes panes;     /* all zero: there are none */
};

/* The corner of a triangle and its edges from there. */
static inline void piece_of(const shadow_tree *t, uint32_t piece, float a[3], float one[3], float other[3]) {
    const float(*corner)[3] = (const float(*)[3])t->corners[piece >> 1];
    const uint32_t second = 1 + (piece & 1);
    for (int d = 0; d < 3; d++) {
        a[d] = corner[0][d];
        one[d] = corner[second][d] - a[d];
        other[d] = corner[second + 1][d] - a[d];
    }
}

/* Makes the panes of a tree whose corners, normals and shapes are there. Errors: LAM_ERR_MEMORY. */
lam_status shadow_panes_make(shadow_tree *t, const shadow_faces *faces, lam_error *error);
void shadow_panes_free(shadow_panes *p);
size_t shadow_panes_bytes(const shadow_panes *p);

/* Makes nodes and the order of pieces, which are those of the fronts in any order. Errors: LAM_ERR_MEMORY. */
lam_status shadow_tree_build(shadow_tree *t, lam_error *error);

#endif
