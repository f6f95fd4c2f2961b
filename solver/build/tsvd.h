/* The truncated SVD of a tall block by its Gram matrix. */
#ifndef LAMBERT_BUILD_TSVD_H
#define LAMBERT_BUILD_TSVD_H

#include "store/status.h"

/* A ~ Q V^T: Q is [rank] columns of n, V is [rank] columns of m, one after the other (column-major), V
 * orthonormal, columns by falling singular value. Both freed by the caller with free(). */
typedef struct tall_factors {
    size_t n, m, rank;
    float *Q;
    float *V;
} tall_factors;

void tall_factors_free(tall_factors *f);

/* What is kept: every singular value of at least epsilon (thesis, algorithm 4, TSVD), so that
 * |A - Q V^T|_2 < epsilon; then, up to the next multiple of round, those of at least epsilon / 2. With rank >
 * 0 exactly min(rank, m) columns are kept instead. */
typedef struct tsvd_options {
    double epsilon;
    size_t rank;
    size_t round; /* 1: none */
} tsvd_options;

/* Factorizes A (m columns of n, column-major). The Gram matrix squares the condition: it is formed in double
 * unless epsilon is above 2e-3 of |A|. Cost: O(n m^2). Errors: LAM_ERR_MEMORY, LAM_ERR_NUMERIC. */
lam_status tsvd(size_t n, size_t m, const float *A, const tsvd_options *options, tall_factors *out,
                lam_error *error);

#endif
