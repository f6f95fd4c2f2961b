/* The norm of the error of a factorization. */
#ifndef LAMBERT_METHOD_NORM_H
#define LAMBERT_METHOD_NORM_H

#include "solver/base/progress.h"
#include "solver/linalg/scaled.h"
#include "solver/method/method.h"
#include "solver/method/tall_factors.h"

/* |S - Q V^T|_2 to about a per cent from below: Lanczos steps on the square of the difference, which is what
 * a power iteration with memory is. f as a factorizer returns it. Cost: a few dozen products with S, Q and V.
 * Errors: LAM_ERR_MEMORY, LAM_ERR_NUMERIC, LAM_ERR_CANCELLED, those of the source of S. */
lam_status norm_of_error(const scaled_matrix *S, const tall_factors *f, const progress *p, double *norm,
                         lam_error *error);

/* w = D^T D q of some matrix D; q and w are [n]. */
typedef lam_status norm_product(void *context, const double *q, double *w, lam_error *error);

/* |D|_2 as norm_of_error finds it, for any D of n columns. Cost: at most 32 products. Errors: also those of
 * the product. */
lam_status norm_of_product(size_t n, norm_product *product, void *context, const progress *p, double *norm,
                           lam_error *error);

/* Reports the norm of the error of factors and what it bounds: |B~ - B| / |B|, area-weighted, is at most
 * norm / (1 - the largest reflectance) for any emission (thesis, eq. 2.9; row sums of F are at most 1, so
 * that the largest singular value of R S is at most that reflectance). O(nC). */
void norm_report(const build_problem *problem, double norm, build_report *report);

#endif
