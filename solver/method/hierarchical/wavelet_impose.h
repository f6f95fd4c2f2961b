/* Row sums that the row of the root of each part of the scene is made to keep, of a matrix in a multiwavelet
 * basis: those of S, and with them an answer of K that is known. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_WAVELET_IMPOSE_H
#define LAMBERT_METHOD_HIERARCHICAL_WAVELET_IMPOSE_H

#include "solver/linalg/csr.h"
#include "solver/method/hierarchical/wavelet_basis.h"

/* Imposes the row sums s of F on S: S A^1/2 = A^1/2 s. The function of the root r of a part of the scene is
 * A^1/2 / |A^1/2| there (wavelet_basis.h makes it positive), so that W A^1/2 s / |A^1/2| has the entries of
 * column r of W S W^T, of the rows of its part. They are replaced, entries up to threshold weight_i weight_r
 * dropped. In a closed scene this leaves 1 on the diagonal: uniform radiosity is transported exactly, and
 * radiosity of mean 0 stays so.
 *
 * S: upper triangle; area by position, row_sums by element, order [n] elements by position, weight by node.
 * Does nothing where there is no root. O(n + entries). Errors: LAM_ERR_MEMORY. */
lam_status wavelet_impose_row_sums(const wavelets *w, const wavelet_roots *roots, const uint32_t *order,
                                   const double *area, const double *row_sums, float threshold,
                                   const float *weight, csr *S, lam_error *error);

/* Imposes an answer on K: of the emission E its irradiance is H, K u = v, u = W A^1/2 E, v = W A^1/2 H. Only
 * the row and column of the root r of each part of the scene change, within the part:
 *     K_ir = (v_i - sum_{j != r} K_ij u_j) / u_r,    K_rr = (v_r - sum_{j != r} K_rj u_j) / u_r.
 * An entry that K has not is left out up to threshold weight_i weight_r; K_rr is the one that is right beside
 * those that stay. With E = 1 - rho s and H = s a furnace (rho the same everywhere, s = 1) keeps K_rr = 1 /
 * (1 - rho) alone in that row, as exactly as a float can be, however many terms and bounces an inverse left
 * out, and as u is the power of absorption, too, the balance of energy sum A (1 - rho) H = sum A E holds for
 * every emission, part by part.
 *
 * K: upper triangle; E and H by element, otherwise as above. Does nothing in a part where E has no light in
 * the mean. O(n + entries). Errors: LAM_ERR_MEMORY. */
lam_status wavelet_impose_answer(const wavelets *w, const wavelet_roots *roots, const uint32_t *order,
                                 const double *area, const double *E, const double *H, float threshold,
                                 const float *weight, csr *K, lam_error *error);

#endif
