/* An orthonormal basis on a binary tree of clusters of elements: area-weighted multiwavelets, applied in
 * O(n). Knows nothing of how it was made, nor of what is written in it.
 *
 * Positions are elements in tree order, so that a cluster is a range of them. A node takes up to eight
 * numbers (of a leaf its elements, above what its two children hand up) and turns them by an orthonormal
 * matrix, its shape, into up to four that it hands up and the rest, which are coefficients: c = W x, x = W^T
 * c. Coefficients are numbered by the nodes in postorder; those of what the root would hand up come last.
 */
#ifndef LAMBERT_OPERATOR_WAVELET_WAVELETS_H
#define LAMBERT_OPERATOR_WAVELET_WAVELETS_H

#include "store/store.h"

#include <stdint.h>

/* Numbers that a node takes, and hands up, at most. */
enum { WAVELET_INPUTS = 8, WAVELET_SCALING = 4 };

#define WAVELET_NONE UINT32_MAX

/* What congruent nodes share. The first `scaling` rows of its matrix are what is handed up. */
typedef struct wavelet_shape {
    uint32_t leaf; /* 1: of elements, 0: of two children */
    uint32_t inputs, scaling;
} wavelet_shape;

typedef struct wavelet_node {
    uint32_t shape;
    uint32_t begin;                      /* its first position */
    uint32_t first;                      /* its first coefficient */
    uint32_t n_elements;                 /* below it */
    uint32_t left;                       /* its left child; the right one is the node before it */
    uint32_t parent;                     /* WAVELET_NONE: it is the root */
    uint32_t inputs, scaling, from_left; /* of the inputs, those of the left child; 0: a leaf */
} wavelet_node;

/* Nodes [first, last) that are whole subtrees, small enough that several threads share the work. */
typedef struct wavelet_piece {
    uint32_t first, last;
} wavelet_piece;

typedef struct wavelets {
    size_t n, n_nodes, n_shapes;
    wavelet_shape *shapes; /* [n_shapes] */
    float *basis;          /* of shape after shape, [inputs][inputs] */
    size_t basis_count;
    wavelet_node *nodes; /* [n_nodes], postorder: children before their parent, the left one first */
    float *padded;       /* [n_shapes][2][8][8]: columns of the matrix, then its rows */
} wavelets;

/* The columns of a node's matrix, eight apart; its rows lie behind them. */
static inline const float *wavelet_columns(const wavelets *w, const wavelet_node *a) {
    return w->padded + (size_t)a->shape * 2 * WAVELET_INPUTS * WAVELET_INPUTS;
}

void wavelets_free(wavelets *w);

/* How many nodes are below each on the longest way to a leaf: out [n_nodes]; leaves: 0. */
void wavelets_heights(const wavelets *w, uint32_t *out);

/* From shapes, basis and the shape of every node in postorder ([n_nodes]; copied); shapes and basis are taken
 * over, also on an error. Errors: LAM_ERR_NUMERIC where the nodes are no tree of n elements, or a shape is
 * out of bounds or has a number that is not finite; LAM_ERR_MEMORY. */
lam_status wavelets_create(size_t n, size_t n_nodes, const uint32_t *node_shapes, size_t n_shapes,
                           wavelet_shape *shapes, float *basis, size_t basis_count, wavelets *out,
                           lam_error *error);

/* GROUP/shape [n_shapes][3] u32, basis [basis_count] f32, node [n_nodes] u32. Errors: as store_read;
 * LAM_ERR_NUMERIC as wavelets_create. */
lam_status wavelets_save(const wavelets *w, const char *group, store *s, lam_error *error);
lam_status wavelets_load(store *s, const char *group, size_t n, wavelets *out, lam_error *error);

#endif
