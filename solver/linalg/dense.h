/* Products of tall dense matrices in single precision, row-major, for the factorizations. All threads work on
 * one product, called from outside a parallel region or from a task in one; the bits do not depend on their
 * number. */
#ifndef LAMBERT_LINALG_DENSE_H
#define LAMBERT_LINALG_DENSE_H

#include "store/status.h"

#include <stdbool.h>

/* C = A B: A is [n][k] and B [k][m] or, transposed, [m][k]; C is [n][m]. */
void dense_multiply(size_t n, size_t k, size_t m, const float *A, const float *B, bool transposed, float *C);

/* G += A^T A of n rows of A, [n][m]; of G, [m][m], only j >= i is set. */
void dense_gram(size_t n, size_t m, const float *A, float *G);

/* dense_gram with all products in double. Errors: LAM_ERR_MEMORY. */
lam_status dense_gram_double(size_t n, size_t m, const float *A, double *G, lam_error *error);

/* C = A^T B of n rows, A [n][m] and B [n][w]: C is [m][w], in double. Errors: LAM_ERR_MEMORY. */
lam_status dense_project(size_t n, size_t m, size_t w, const float *A, const float *B, double *C,
                         lam_error *error);

/* t = A^T x, A [n][m] row by row or, with columns, column by column: one call of BLAS, for benchmarks. */
void dense_vector(size_t n, size_t m, const float *A, bool columns, const float *x, float *t);

#endif
