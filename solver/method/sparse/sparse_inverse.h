/* The inverse of I - R F as a sparse matrix: rows of a Neumann series, small terms dropped (Aguerre 2016,
 * chapter 4). */
#ifndef LAMBERT_METHOD_SPARSE_SPARSE_INVERSE_H
#define LAMBERT_METHOD_SPARSE_SPARSE_INVERSE_H

#include "solver/method/inverse_rows.h"

/* --correction. */
typedef enum sparse_correction { SPARSE_NONE, SPARSE_DELTA, SPARSE_DISCARDED } sparse_correction;

/* The options of --method sparse. */
typedef struct sparse_options {
    double threshold; /* entries below it are left out; 0: not given */
    sparse_correction correction;
} sparse_options;

/* The limits of what is kept. Rows of black elements are as if rho were 1 there, and their irradiance is all
 * that they are asked for: whole_black keeps all of their first bounce, which the form factors hold already,
 * so that an element gets no light from where it sees nothing. */
typedef struct sparse_limits {
    double threshold;
    bool whole_black;
} sparse_limits;

typedef struct sparse_inverse {
    csr M;             /* M~ - I by position; rows with rho = 0 as if rho were 1 there */
    double *discarded; /* [n] by position, the sum of the terms dropped from each row */
    size_t bounces;    /* of the longest row */
} sparse_inverse;

void sparse_inverse_free(sparse_inverse *s);

/* One channel, Aguerre 2016, algorithms 5 and 6: for each row
 *     T_0 = row of I,  T_{b+1} = drop(T_b drop(R F)),  M~ - I = sum_{b>0} T_b,
 * where drop leaves out entries below threshold. The sum of all that is left out, also of R F (which the
 * thesis does not count), is `discarded`. rho is [n] in mesh order. The bits do not depend on the number of
 * threads. Cost: a row of R F for every entry of every T. Errors: LAM_ERR_MEMORY also if the entries would
 * exceed `memory` bytes (0: no limit), LAM_ERR_CANCELLED. */
lam_status sparse_inverse_rows(const build_problem *problem, const float *rho, const sparse_limits *limits,
                               size_t memory, const progress *p, sparse_inverse *out, lam_error *error);

/* Estimates the number of entries from a sample of rows. */
lam_status sparse_inverse_forecast(const build_problem *problem, const float *rho,
                                   const sparse_limits *limits, double *entries, lam_error *error);

/* Estimates of a sparse inverse from the sampled rows: entries of all rows; single = |M - M~|_F / |M - I|_F,
 * the error of elements that receive; everywhere = the same ratio of sums of rows, the error of uniform
 * emission; errors as those of any operator. A small element receives by large entries of M and emits by
 * small ones, so that a threshold may keep its row and lose its column. */
typedef struct sparse_sample {
    double entries, single, everywhere;
    sampled_errors errors;
} sparse_sample;

/* For M~ = M without its entries below the threshold, a lower bound of the entries that algorithm 5 needs. */
sparse_sample inverse_rows_truncated(const inverse_rows *r, double threshold);

/* For M~ of algorithm 5, corrected by the error of uniform emission; columns as those of M without its
 * entries below the threshold, which algorithm 5 has no more of. Errors: LAM_ERR_MEMORY. */
lam_status sparse_inverse_sample(const build_problem *problem, const float *rho, const sparse_limits *limits,
                                 const inverse_rows *truth, sparse_sample *out, lam_error *error);

#endif
