/* The truncated SVD of a tall block by its Gram matrix. */
#ifndef LAMBERT_METHOD_LOW_RANK_TSVD_H
#define LAMBERT_METHOD_LOW_RANK_TSVD_H

#include "solver/linalg/scaled.h"
#include "solver/method/tall_factors.h"

/* The truncation rule: every singular value of at least epsilon is kept (Aguerre 2016, algorithm 4, TSVD), so
 * that |A - Q V^T|_2 < epsilon; then, up to the next multiple of round, those of at least epsilon / 2. With
 * rank > 0 exactly min(rank, m) columns are kept instead. */
typedef struct truncation {
    double epsilon;
    size_t rank;
    size_t round; /* 0 or 1: none */
    size_t guess; /* expected rank; 0: unknown */
} truncation;

/* Factorizes A, [n][m]. The Gram matrix squares the condition: it is formed in double unless epsilon is above
 * 2e-3 of |A|. Cost: O(n m^2). Errors: LAM_ERR_MEMORY, LAM_ERR_NUMERIC. */
lam_status tsvd(size_t n, size_t m, const float *A, const truncation *keep, tall_factors *out,
                lam_error *error);

/* Rows of parts that are joined at a time. */
enum { TSVD_JOINED = 4096 };

/* The same of A = (Q_1 | Q_2 | ...), which is never formed as a whole. Empty parts are skipped; one must not
 * be. The Q of the parts is freed, from its last rows on as those of Q are made, so that memory never holds
 * both as a whole. */
lam_status tsvd_joined(size_t count, tall_factors *parts, const truncation *keep, tall_factors *out,
                       lam_error *error);

/* The same of a sparse block: a row with few entries costs the square of their number, not m^2. */
lam_status tsvd_sparse(const sparse_block *A, const truncation *keep, tall_factors *out, lam_error *error);

/* The squares of the singular values of the first m columns of A, ascending, into values [m]. */
lam_status tsvd_values(const sparse_block *A, size_t m, double *values, lam_error *error);

/* The rank that a truncation keeps; values [m] are the squares of the singular values, ascending. */
size_t truncation_rank(const truncation *keep, size_t m, const double *values);

#endif
