/* Makes the multiwavelet basis (Gortler et al. 1993) of a cluster tree: the scaling functions of
 * a node in one plane are the constant and the two linear functions times A^1/2, those of a node above planes
 * the constant. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_WAVELET_BASIS_H
#define LAMBERT_METHOD_HIERARCHICAL_WAVELET_BASIS_H

#include "solver/operator/blocks/plane_tree.h"
#include "solver/operator/wavelet/wavelets.h"

/* area, centre: [n], by element. out is freed with wavelets_free. Errors: LAM_ERR_MEMORY, LAM_ERR_NUMERIC. */
lam_status wavelet_basis_make(const plane_tree *tree, const double *area, const double (*centre)[3],
                              wavelets *out, lam_error *error);

#endif
