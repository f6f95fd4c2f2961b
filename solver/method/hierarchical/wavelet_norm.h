/* The Frobenius norm of S = A^1/2 F A^-1/2: the root of the sum of the squares of the rows that single
 * elements shine by. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_WAVELET_NORM_H
#define LAMBERT_METHOD_HIERARCHICAL_WAVELET_NORM_H

#include "solver/linalg/csr.h"
#include "solver/operator/blocks/block_factors.h"

/* The norm of rows of F; area [n] by element. Cost: one pass over F. */
double wavelet_norm_of_rows(const csr *F, const double *area);

/* The norm of blocks, each taken for its mean: slopes have less than a hundredth of the norm. Cost: one pass
 * over the blocks. Errors: LAM_ERR_MEMORY. */
lam_status wavelet_norm_of_blocks(const block_factors *f, double *out, lam_error *error);

#endif
