/* Makes the cluster tree of rows of F, and the multiwavelet basis (Gortler et al. 1993) of a cluster tree:
 * the scaling functions of a node in one plane are the constant and the two linear functions times A^1/2,
 * those of a node above planes the constant. A node whose children are of different parts of the scene leaves
 * their functions as they are, so that no function has elements of several parts: a matrix that joins no
 * parts has no coefficient between them, whatever is left out of it. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_WAVELET_BASIS_H
#define LAMBERT_METHOD_HIERARCHICAL_WAVELET_BASIS_H

#include "solver/linalg/csr.h"
#include "solver/operator/blocks/plane_tree.h"
#include "solver/operator/wavelet/wavelets.h"

/* The tree of the basis of rows, with leaves of PLANE_LEAF. The parts of the scene that it keeps apart are
 * those that F does not join; where F is NULL, those of part [n] (NULL:
 * one). Otherwise as plane_tree_make. Cost: O(n log n), and the entries of F if it has several parts. Errors:
 * LAM_ERR_MEMORY. */
lam_status wavelet_tree_make(size_t n, const csr *F, const uint32_t *part, const double (*centre)[3],
                             const float (*normal)[3], const element_corners *corners, plane_tree *out,
                             lam_error *error);

/* area, centre: [n], by element. out is freed with wavelets_free. Errors: LAM_ERR_MEMORY, LAM_ERR_NUMERIC. */
lam_status wavelet_basis_make(const plane_tree *tree, const double *area, const double (*centre)[3],
                              wavelets *out, lam_error *error);

/* The root of each part of the scene is the coefficient of the constant over all of it, which is the last of
 * the coefficients of its part. One part of a single plane has none: WAVELET_NONE throughout. */
typedef struct wavelet_roots {
    uint32_t *of_node; /* [n_nodes], of its part; of a node whose children are apart: of the left one */
    uint32_t *of_coefficient; /* [n], of its part */
    size_t count;
} wavelet_roots;

/* basis: made of the tree. Freed with wavelet_roots_free. Errors: LAM_ERR_MEMORY. */
lam_status wavelet_roots_make(const plane_tree *tree, const wavelets *basis, wavelet_roots *out,
                              lam_error *error);
void wavelet_roots_free(wavelet_roots *r);

#endif
