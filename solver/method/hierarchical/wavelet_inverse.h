/* K = S (I - R S)^-1 in a wavelet basis, R being the diagonal matrix of reflectances, by doubling of its
 * Neumann series,
 *     Z_2m = Z_m R Z_m,   K_2m = K_m + Z_2m + Z_m R (K_m - Z_m),   K_1 = Z_1 = S,
 * with K_m the sum of m bounces and Z_m = S (R S)^(m-1), so that the first doubling takes one product. Both
 * are symmetric, and nothing is divided by R. Small entries are dropped after every product, so that matrices
 * stay sparse. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_WAVELET_INVERSE_H
#define LAMBERT_METHOD_HIERARCHICAL_WAVELET_INVERSE_H

#include "solver/base/progress.h"
#include "solver/linalg/csr.h"
#include "solver/operator/wavelet/wavelets.h"

#include <stdbool.h>

typedef struct wavelet_inverse_input {
    const wavelets *basis;
    csr *S;
    bool last;           /* nobody needs S afterwards: it is freed on the way */
    const float *rho;    /* [n], by position, in [0, 1) */
    const float *weight; /* [n_nodes] */
    float threshold;     /* of all shares, times weight_i weight_j: */
    float entry, tile; /* K_ij is kept above `entry`, where all K between two nodes, over their weights, have
                          a 2-norm above `tile` */
    /* [n_nodes]; times NULL: 1. K is kept above entry and tile times tile_times_a tile_times_b over the
     * larger of read_a emits_b and read_b emits_a; read, emits NULL: 1. */
    const float *tile_times, *tile_read, *tile_emits;
    float inner;   /* entries of products are kept above this share of it */
    float skipped; /* terms of products are left out below this share of it */
    size_t n_threads;
    const progress *progress;
} wavelet_inverse_input;

typedef struct wavelet_inverse_report {
    size_t doublings; /* the series has 2^doublings bounces */
    double terms;     /* multiplications and additions */
} wavelet_inverse_report;

/* out: the upper triangle of K, freed with csr_free. Doubling ends when Z has no entry above its threshold.
 * Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status wavelet_inverse(const wavelet_inverse_input *input, csr *out, wavelet_inverse_report *report,
                           lam_error *error);

/* The upper triangle of W R W^T. Only functions of a node and of its ancestors couple, and none do where rho
 * is constant on the node. */
lam_status wavelet_diagonal(const wavelets *w, const float *rho, csr *out, lam_error *error);

#endif
