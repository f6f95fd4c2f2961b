/* Sparse rows from two others. */
#ifndef LAMBERT_FORMFACTOR_ROWS_ROW_MERGE_H
#define LAMBERT_FORMFACTOR_ROWS_ROW_MERGE_H

#include "solver/linalg/csr.h"

/* out = u A + w B, without entries that come to 0; the caller frees it with csr_free. Both have n rows.
 * It lies where A does. Cost: O(nnz). Errors: LAM_ERR_MEMORY, LAM_ERR_IO. */
lam_status rows_combine(const csr *A, float u, const csr *B, float w, csr *out, lam_error *error);

/* A with the entries of B in place of its own, and in place of nothing; those that are 0 in B are left out.
 */
lam_status rows_replace(const csr *A, const csr *B, csr *out, lam_error *error);

#endif
