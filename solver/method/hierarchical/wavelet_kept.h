/* Coefficients that threads keep in any sequence, and the matrix of all of them. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_WAVELET_KEPT_H
#define LAMBERT_METHOD_HIERARCHICAL_WAVELET_KEPT_H

#include "solver/linalg/csr.h"
#include "solver/operator/wavelet/wavelets.h"

/* A coefficient above the diagonal or on it: of (i, j) and (j, i) the first one, i <= j. */
typedef struct kept {
    uint32_t i, j;
    float value;
} kept;

typedef struct kept_list {
    kept *list;
    size_t count, capacity;
} kept_list;

void kept_free(kept_list *k);

/* Errors: LAM_ERR_MEMORY. */
lam_status kept_put(kept_list *k, uint32_t i, uint32_t j, float value, lam_error *error);

/* All of n_lists lists, which are freed, as an upper triangle [n][n] of ascending rows, which the caller
 * frees; what two of them have stands there twice. Errors: LAM_ERR_MEMORY. */
lam_status kept_gather(size_t n, kept_list *lists, size_t n_lists, csr *out, lam_error *error);

/* Of each coefficient what either side of the diagonal found, on it twice: their sums from threshold weight_i
 * weight_j on; weight by node. Errors: LAM_ERR_MEMORY. */
lam_status kept_add_sides(const wavelets *w, const float *weight, float threshold, csr *S, lam_error *error);

#endif
