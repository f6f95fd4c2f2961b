/* An orthonormal basis of the columns of a tall matrix. */
#ifndef LAMBERT_METHOD_LOW_RANK_ORTHONORMAL_H
#define LAMBERT_METHOD_LOW_RANK_ORTHONORMAL_H

#include "store/status.h"

/* Q [n][k], k <= n, becomes orthonormal columns whose span holds that of the ones given, however they depend
 * on each other (Householder QR). Cost: O(n k^2). Errors: LAM_ERR_MEMORY, LAM_ERR_NUMERIC. */
lam_status orthonormal_columns(size_t n, size_t k, float *Q, lam_error *error);

#endif
