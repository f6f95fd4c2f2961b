/* From factors of F to what an operator holds. */
#ifndef LAMBERT_METHOD_LOW_RANK_FOLD_FACTORS_H
#define LAMBERT_METHOD_LOW_RANK_FOLD_FACTORS_H

#include "solver/linalg/scaled.h"
#include "solver/method/low_rank/tsvd.h"
#include "solver/method/method.h"

/* U [n][k] becomes Y = -R' U core (Aguerre 2016, eq. 2.8), R' with 1 for a reflectance of 0; row r is element
 * order[r], NULL: r. Cost: O(n k^2), a block of rows at a time. Errors: LAM_ERR_MEMORY. */
lam_status finish_fold(size_t n, size_t k, const float *core, const float *reflectance, const uint32_t *order,
                       float *U, lam_error *error);

/* The operator of S ~ Q V^T, both with rows in positions of S: folded for one channel unless its factors are
 * to be kept, else factored. Frees f. *rcond is the worst of the cores'. Errors: LAM_ERR_MEMORY, as
 * core_invert. */
lam_status finish_low_rank(const build_problem *problem, const scaled_matrix *S, tall_factors *f,
                           bool keep_factors, lam_operator **op, double *rcond, lam_error *error);

#endif
