/* An orthonormal multiwavelet basis W on a binary tree of clusters of elements (Gortler et al. 1993), c = W x
 * and x = W^T c in O(n). It knows neither how the basis was chosen nor which matrix is written in it.
 *
 * Positions are elements in tree order, so that a cluster is a range of them. A node has up to eight inputs:
 * the values of its elements (a leaf) or the scaling coefficients of its two children. Its orthonormal
 * matrix, the shape, turns them into up to four scaling coefficients, which go to its parent, and wavelet
 * coefficients. Coefficients are numbered by nodes in postorder; the scaling coefficients of the root come
 * last. */
#ifndef LAMBERT_OPERATOR_WAVELET_WAVELETS_H
#define LAMBERT_OPERATOR_WAVELET_WAVELETS_H

#include "store/store_map.h"

#include <stdint.h>

/* Most inputs and most scaling coefficients of a node. */
enum { WAVELET_INPUTS = 8, WAVELET_SCALING = 4 };

#define WAVELET_NONE UINT32_MAX

/* The matrix that congruent nodes share; its first `scaling` rows give the scaling coefficients. */
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

/* Nodes [first, last), a subtree that one thread takes at a time. */
typedef struct wavelet_piece {
    uint32_t first, last;
} wavelet_piece;

typedef struct wavelets {
    size_t n, n_nodes, n_shapes;
    wavelet_shape *shapes; /* [n_shapes] */
    float *basis;          /* the matrices, shape after shape, [inputs][inputs] */
    size_t basis_count;
    wavelet_node *nodes; /* [n_nodes], postorder: children before their parent, the left one first */
    float *padded;       /* [n_shapes][2][8][8]: columns of the matrix, then its rows */
} wavelets;

/* The columns of a node's matrix, eight apart; its rows lie behind them. */
static inline const float *wavelet_columns(const wavelets *w, const wavelet_node *a) {
    return w->padded + (size_t)a->shape * 2 * WAVELET_INPUTS * WAVELET_INPUTS;
}

void wavelets_free(wavelets *w);

/* out [n_nodes] = the height of each node: the longest path to a leaf below it; leaves have 0. */
void wavelets_heights(const wavelets *w, uint32_t *out);

/* out [n_nodes] = the weight of each node's coefficients beside a threshold: the number of elements below it
 * to the power -1/4, over the geometric mean of that of all coefficients, as fine coefficients are mostly
 * noise. The caller frees it. Errors: LAM_ERR_MEMORY. */
lam_status wavelets_weights(const wavelets *w, float **out, lam_error *error);

/* Builds the basis from the shape of every node in postorder (node_shapes [n_nodes], copied). It takes over
 * shapes and basis, also on an error. Errors: LAM_ERR_NUMERIC when the nodes are no tree of n elements, a
 * shape is out of bounds or a number is not finite; LAM_ERR_MEMORY. */
lam_status wavelets_create(size_t n, size_t n_nodes, const uint32_t *node_shapes, size_t n_shapes,
                           wavelet_shape *shapes, float *basis, size_t basis_count, wavelets *out,
                           lam_error *error);

/* Doubles of work for a transform in double. */
static inline size_t wavelets_work(const wavelets *w) {
    return w->n_nodes * WAVELET_SCALING;
}

/* c = W x for one vector in double: x [n] by position, c [n] by coefficient. A number is rounded in a sum of
 * at most eight products for each node above its element. */
void wavelets_forward(const wavelets *w, const double *x, double *c, double *work);

/* GROUP/shape [n_shapes][3] u32, basis [basis_count] f32, node [n_nodes] u32. Errors: as store_write. */
lam_status wavelets_save(const wavelets *w, const char *group, store *s, lam_error *error);

/* These arrays of a store, which may be mapped. Errors of wavelets_read: as store_read_view. wavelets_make
 * copies them. Errors: as wavelets_create. */
typedef struct wavelet_arrays {
    store_view shape, basis, node;
    size_t n_shapes, basis_count, n_nodes;
} wavelet_arrays;
lam_status wavelets_read(store *s, const char *group, wavelet_arrays *out, lam_error *error);
lam_status wavelets_make(const wavelet_arrays *from, size_t n, wavelets *out, lam_error *error);
void wavelet_arrays_free(wavelet_arrays *arrays);

#endif
