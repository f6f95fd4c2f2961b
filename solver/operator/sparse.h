/* The arrays of a sparse operator. */
#ifndef LAMBERT_OPERATOR_SPARSE_H
#define LAMBERT_OPERATOR_SPARSE_H

#include "solver/linalg/csr.h"
#include "solver/operator/operator.h"

typedef struct sparse_arrays {
    csr *M;         /* [C], of n rows each: P without its dropped entries; rows and columns are positions */
    float *delta;   /* [C][n] by position, the sum of each row's dropped entries; or NULL */
    float *weight;  /* [n] by position, its sum is 1 in each part; NULL with delta */
    uint32_t *part; /* [n] by position, below n: parts of a scene that do not see each other; NULL: one */
} sparse_arrays;

void sparse_arrays_free(sparse_arrays *arrays, size_t n_channels);

/* P_p = (M E)_p + delta_p sum_q weight_q E_q, over q in the part of p. Takes over what arrays points to, also
 * on an error, and zeroes it. */
lam_status operator_sparse_create(size_t n, size_t n_channels, const float *reflectance,
                                  sparse_arrays *arrays, lam_operator **op, lam_error *error);

#endif
