/* A sparse matrix times a batch of vectors; a vector that is mostly 0 costs only the columns that it meets.
 */
#ifndef LAMBERT_LINALG_SPARSE_PRODUCT_H
#define LAMBERT_LINALG_SPARSE_PRODUCT_H

#include "solver/linalg/csr.h"

#include <stdbool.h>

/* out: the transpose of a; the caller frees it with csr_free. Cost: O(nnz + n). Errors: LAM_ERR_MEMORY. */
lam_status csr_transpose(const csr *a, csr *out, lam_error *error);

/* A matrix by rows and by columns (its transpose). */
typedef struct sparse_pair {
    const csr *rows, *columns;
    size_t n_threads;
} sparse_pair;

/* Bytes of work for m vectors, at most 16; 0 when that overflows. */
size_t sparse_product_work(size_t n, size_t m);

/* True when sparse_product multiplies x by columns. */
bool sparse_product_by_columns(const csr *columns, const float *x);

/* Y_v = A X_v for m vectors, at most 16: X_v = X + v x_stride holds n numbers; Y_v = Y + v y_stride gets n,
 * or, where chosen is not NULL, the n_chosen rows chosen[r] (map[chosen[r]] where map is not NULL). A vector
 * that is mostly 0 is multiplied by the columns of its nonzero entries, the others are multiplied by rows,
 * together. The choice and the bits of a result depend on its vector alone. work is aligned to a cache line.
 */
void sparse_product(const sparse_pair *A, size_t m, const float *X, size_t x_stride, size_t n_chosen,
                    const uint32_t *chosen, const uint32_t *map, float *Y, size_t y_stride, void *work);

#endif
