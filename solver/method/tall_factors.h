/* Factors of S ~ Q V^T, and the operators that are made of them. */
#ifndef LAMBERT_METHOD_TALL_FACTORS_H
#define LAMBERT_METHOD_TALL_FACTORS_H

#include "lambert/lambert.h"
#include "solver/linalg/scaled.h"

struct build_problem;

/* A ~ Q V^T: Q is [n][rank], V is [m][rank] with orthonormal columns, by descending singular value. Both
 * freed by tall_factors_free. Since Q = A V, the rows of the remainder A (I - V V^T) are orthogonal to the
 * columns of V. */
typedef struct tall_factors {
    size_t n, m, rank;
    float *Q;
    float *V;
} tall_factors;

void tall_factors_free(tall_factors *f);

/* Q [n][k], k <= n, becomes orthonormal columns whose span holds that of the ones given, however they depend
 * on each other (Householder QR). Cost: O(n k^2). Errors: LAM_ERR_MEMORY, LAM_ERR_NUMERIC. */
lam_status orthonormal_columns(size_t n, size_t k, float *Q, lam_error *error);

/* U [n][k] becomes Y = -R' U core (Aguerre 2016, eq. 2.8), R' with 1 for a reflectance of 0; row r is element
 * order[r], NULL: r. Cost: O(n k^2), a block of rows at a time. Errors: LAM_ERR_MEMORY. */
lam_status factors_fold(size_t n, size_t k, const float *core, const float *reflectance,
                        const uint32_t *order, float *U, lam_error *error);

/* The operator of S ~ Q V^T, both with rows in positions of S: folded for one channel unless its factors are
 * to be kept, else factored. Frees f. *rcond is the worst of the cores'. Errors: LAM_ERR_MEMORY, as
 * core_invert. */
lam_status operator_of_factors(const struct build_problem *problem, const scaled_matrix *S, tall_factors *f,
                               bool keep_factors, lam_operator **op, double *rcond, lam_error *error);

#endif
