/* The Gram matrix A^T A of a tall block and its eigenvectors. */
#ifndef LAMBERT_METHOD_LOW_RANK_GRAM_H
#define LAMBERT_METHOD_LOW_RANK_GRAM_H

#include "solver/linalg/scaled.h"

/* [m][m], entries j >= i alone; in single precision or in double, one of the two. */
typedef struct gram {
    size_t m;
    float *single;
    double *full;
} gram;

/* Makes a zero matrix. Errors: LAM_ERR_MEMORY. */
lam_status gram_create(size_t m, bool single, gram *g, lam_error *error);
void gram_free(gram *g);

/* g += A^T A of A [n][m], or of the first m columns of a sparse block. A row with few entries costs
 * the square of their number. Errors: LAM_ERR_MEMORY. */
lam_status gram_add(gram *g, size_t n, const float *A, lam_error *error);
lam_status gram_add_sparse(gram *g, const sparse_block *A, lam_error *error);

/* All eigenvalues, ascending, into values [m]; with vectors, row c of g becomes the c-th eigenvector. Cost:
 * O(m^3). Errors: LAM_ERR_MEMORY, LAM_ERR_NUMERIC. */
lam_status gram_eigen(gram *g, bool vectors, double *values, lam_error *error);

/* V [m][*rank], orthonormal, freed by the caller: approximate eigenvectors of the eigenvalues above floor, by
 * subspace iteration until x^T G x <= floor |x|^2 for every x orthogonal to V (checked by Lanczos steps, to
 * about a per cent). *rank is 0 and *V NULL if they are so many that gram_eigen is cheaper. g is in single
 * precision; its lower half is set too. guess is their expected number, 0: unknown. Cost: O(m^2 rank). Errors
 * as above. */
lam_status gram_leading(gram *g, double floor, size_t guess, float **V, size_t *rank, lam_error *error);

#endif
