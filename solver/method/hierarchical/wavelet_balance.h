/* S in wavelets made to give one even light what rows sum to. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_WAVELET_BALANCE_H
#define LAMBERT_METHOD_HIERARCHICAL_WAVELET_BALANCE_H

#include "solver/linalg/csr.h"
#include "solver/operator/wavelet/wavelets.h"

/* Of one radiosity everywhere S makes the row sums, S A^1/2 = A^1/2 s: A^1/2 over its length is what a root
 * of constants would hand up (wavelet_basis.h makes it of moments, which are positive), the last coefficient,
 * so that W A^1/2 s over that length is the last row of S and its last column. It is put in their place, from
 * threshold weight_i weight_root on; of a closed scene it is 1 on the diagonal and nothing else, and all
 * other light sums to nothing.
 *
 * S: upper triangle; area by position, row_sums by element, order [n] elements by position, weight by node. A
 * root that hands up more than constants is left as it is. Errors: LAM_ERR_MEMORY. */
lam_status wavelet_balance(const wavelets *w, const uint32_t *order, const double *area,
                           const double *row_sums, float threshold, const float *weight, csr *S,
                           lam_error *error);

#endif
