/* The transport matrix S = A^1/2 F A^-1/2 in a multiwavelet basis W, as in wavelet_pass.h, from form factors
 * by cluster blocks: no pair of elements is visited. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_WAVELET_BLOCKS_H
#define LAMBERT_METHOD_HIERARCHICAL_WAVELET_BLOCKS_H

#include "solver/base/progress.h"
#include "solver/linalg/csr.h"
#include "solver/operator/blocks/block_factors.h"
#include "solver/operator/wavelet/wavelets.h"

typedef struct wavelet_blocks_input {
    const block_factors *blocks; /* after block_factors_end */
    const wavelets *basis;       /* of the tree of the blocks (wavelet_basis.h) */
    float threshold;             /* coefficient (i, j) is kept above threshold weight_i weight_j */
    const float *weight;         /* [n_nodes], of all coefficients of a node */
    size_t n_threads;
    const progress *progress;
} wavelet_blocks_input;

/* out: the upper triangle of W S W^T with its diagonal, freed by the caller with csr_free.
 *
 * On either side of a block the light is a combination of the node's scaling functions, so that the block is
 *     Phi_a S1 Phi_b^T = M_a L M_b^T,   M_t = sum over elements i of t of Phi_t(i) A_i^1/2 d_i m_t(i)^T,
 * d the balance, and has no coefficient with a wavelet within a or within b: exactly so where d is 1, and
 * else up to what d varies within a cluster. S = S1 + S1^T. All column nodes of one row node a go up the tree
 * together, each ancestor once, which yields Phi_a S1 W^T by columns. Rows go up the tree once: node a joins
 * the columns of its two children by its matrix, (Phi_a; Psi_a) = Q_a (Phi_left; Phi_right); Psi_a S1 W^T are
 * coefficients, Phi_a S1 W^T with the node's own blocks is carried to its parent.
 *
 * The bits do not depend on n_threads. Cost: some steps of 6 x 6 numbers for each block. Errors:
 * LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status wavelet_blocks(const wavelet_blocks_input *input, csr *out, lam_error *error);

#endif
