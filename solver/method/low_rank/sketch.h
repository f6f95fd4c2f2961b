/* Random matrices and orthonormal bases of tall blocks, for the randomized factorizers (Halko et al. 2011).
 */
#ifndef LAMBERT_METHOD_LOW_RANK_SKETCH_H
#define LAMBERT_METHOD_LOW_RANK_SKETCH_H

#include "solver/method/low_rank/factorizer.h"

/* X [n][m] with independent standard Gaussian entries, the same for a seed whatever the threads. */
void sketch_gaussian(uint64_t seed, size_t n, size_t m, float *X);

/* The entries of a column of a sparse Gaussian matrix; several may share a row. */
enum { SKETCH_ENTRIES = 8 };

typedef struct sketch_entry {
    size_t row;
    float value;
} sketch_entry;

/* Column i of the sparse Gaussian matrix of k rows that a seed stands for. */
void sketch_sparse_column(uint64_t seed, size_t k, size_t i, sketch_entry column[SKETCH_ENTRIES]);

/* Replaces the columns of Y, [n][m], by an orthonormal basis of their span, to the rounding of single
 * precision; *rank, at most m, is how many it takes: directions below 1e-6 of the largest are left out, and Y
 * becomes [n][*rank]. It takes the Cholesky factor or, where that fails, eigenvectors of the Gram matrix in
 * double, twice. Cost: O(n m^2). Errors: LAM_ERR_MEMORY, LAM_ERR_NUMERIC. */
lam_status sketch_orthonormalize(size_t n, size_t m, float *Y, size_t *rank, lam_error *error);

/* |S - B X^T|_2, X and B [n][m], to about a tenth from below: power iteration on the square of the difference
 * with eight vectors at once, six passes. Errors: those of norm_of_error. */
lam_status norm_estimate(const scaled_matrix *S, size_t m, const float *X, const float *B, uint64_t seed,
                         double *norm, lam_error *error);

/* An orthonormal basis X [n][m] and B [n][m], which is S X or close to it: S ~ B X^T. */
typedef struct sketch_basis {
    size_t n, m;
    float *X, *B;
} sketch_basis;

void sketch_basis_free(sketch_basis *b);

/* Finds a basis of m vectors, fewer where S has no more to give. */
typedef lam_status (*sketch_find)(const scaled_matrix *S, const factorizer_options *options, size_t m,
                                  sketch_basis *out, lam_error *error);

/* S ~ Q V^T by bases from find: exactly options->rank columns, or as many as options->epsilon needs; then
 * what a basis leaves out is measured (norm_estimate, with a tenth to spare), and where that is too much a
 * larger one is taken. exact says that B = S X: then what the basis leaves out and what is truncated are
 * orthogonal and their squares add, as in budget.h; else the two add, and a column of Q longer than 1 (|S| is
 * at most 1) is cut to 1. */
lam_status sketch_factorize(const scaled_matrix *S, const factorizer_options *options, sketch_find find,
                            bool exact, tall_factors *out, lam_error *error);

#endif
