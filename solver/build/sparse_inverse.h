/* The inverse of I - R F kept sparse: rows of a Neumann series whose small terms are left out (Aguerre 2016,
 * chapter 4). */
#ifndef LAMBERT_BUILD_SPARSE_INVERSE_H
#define LAMBERT_BUILD_SPARSE_INVERSE_H

#include "solver/build/build.h"

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

#endif
