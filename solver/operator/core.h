/* The k x k core of a low-rank operator, inverted in double and judged by its condition. */
#ifndef LAMBERT_OPERATOR_CORE_H
#define LAMBERT_OPERATOR_CORE_H

#include "store/status.h"

/* A core worse than this is refused. */
#define CORE_RCOND_MIN 1e-12

/* K := K^-1, K [k][k] row-major, by LU; *rcond is its reciprocal condition number in the 1-norm (1 for k =
 * 0). On an error K's content is lost. Cost: O(k^3). Errors: LAM_ERR_NUMERIC (singular, not finite or rcond
 * below CORE_RCOND_MIN), LAM_ERR_MEMORY, LAM_ERR_ARGUMENT (k past what LAPACK counts to). */
lam_status core_invert(size_t k, double *K, double *rcond, lam_error *error);

/* core [k][k] = (I - V^T R U)^-1 with R = diag(rho): V and U are [n][k], rows in the same order as rho [n].
 * Summed and inverted in double. Cost: O(n k^2 + k^3). Errors: as core_invert. */
lam_status core_factored(size_t k, size_t n, const float *V, const float *U, const float *rho, float *core,
                         double *rcond, lam_error *error);

#endif
