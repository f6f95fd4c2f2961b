/* Sums of sparse rows. */
#ifndef LAMBERT_FORMFACTOR_ROWS_H
#define LAMBERT_FORMFACTOR_ROWS_H

#include "solver/operator/csr.h"

/* out = u A + w B, without entries that come to 0; the caller frees it with csr_free. Both have n rows.
 * Cost: O(nnz). Errors: LAM_ERR_MEMORY. */
lam_status rows_combine(const csr *A, float u, const csr *B, float w, csr *out, lam_error *error);

#endif
