/* The inverse of I - R F kept sparse: rows of a Neumann series whose small terms are left out (Aguerre 2016,
 * chapter 4). */
#ifndef LAMBERT_METHOD_SPARSE_SPARSE_INVERSE_H
#define LAMBERT_METHOD_SPARSE_SPARSE_INVERSE_H

#include "solver/method/method.h"

typedef struct sparse_inverse {
    csr M;             /* P = M~ - I by position; rows without reflectance as if it were 1 there */
    double *discarded; /* [n] by position, the sum of what was left out of each row */
    size_t bounces;    /* of the longest row */
} sparse_inverse;

void sparse_inverse_free(sparse_inverse *s);

/* One channel, algorithms 5 and 6: a row of T, which begins as that of I, becomes T R F bounce after bounce;
 * entries below threshold are left out of R F and of every T, and the rest is added up. (What is left out of
 * R F counts among what is discarded, which the thesis forgets.) rho is [n] in mesh order. Every row is by
 * itself: the result is the same for any number of threads. Cost: for every entry that T ever keeps a row of
 * R F. Errors: LAM_ERR_MEMORY also where entries would pass memory bytes (0: no limit), LAM_ERR_CANCELLED. */
lam_status sparse_inverse_rows(const build_problem *problem, const float *rho, double threshold,
                               size_t memory, const progress *told, sparse_inverse *out, lam_error *error);

/* Entries of all rows, from some of them. */
lam_status sparse_inverse_forecast(const build_problem *problem, const float *rho, double threshold,
                                   double *entries, lam_error *error);

/* Some rows of M - I, exact to single precision, by which a sparse inverse is judged: those of positions
 * k n / count, rows [count][n] by position. */
typedef struct inverse_rows {
    size_t n, count;
    float *rows;
    double square, sum; /* of all */
} inverse_rows;

void inverse_rows_free(inverse_rows *r);

/* Finds them as columns, which is the same by reciprocity: A_i/rho_i (M - I)_ij is symmetric. Cost: a few
 * dozen products of F with a block of vectors. Errors: those of columns_solve. */
lam_status inverse_rows_find(const build_problem *problem, const float *rho, const progress *told,
                             inverse_rows *out, lam_error *error);

/* What a sparse inverse has and lacks, as its rows tell: entries of all rows; of single elements' light
 * |M - M~|_F over |M - I|_F; of light from everywhere the same of the sums of rows. */
typedef struct sparse_sample {
    double entries, single, everywhere;
} sparse_sample;

/* If nothing but the entries of M below the threshold were missing: fewer entries than it takes. */
sparse_sample inverse_rows_truncated(const inverse_rows *r, double threshold);

/* As algorithm 5 makes them. Errors: LAM_ERR_MEMORY. */
lam_status sparse_inverse_sample(const build_problem *problem, const float *rho, double threshold,
                                 const inverse_rows *truth, sparse_sample *out, lam_error *error);

#endif
