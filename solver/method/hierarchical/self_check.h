/* A short test of a finished operator against the form factors that it was built from. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_SELF_CHECK_H
#define LAMBERT_METHOD_HIERARCHICAL_SELF_CHECK_H

#include "solver/method/method.h"

/* Tests op on random emissions by its residual, and on uniform radiosity, whose emission is known, and
 * reports
 *     probe_residual  |E - (I - R F) B~| / |E|, the mean over a few random emissions; with streamed F only
 * some rows count, of an independent sample, with its noise; uniform_error   |B~ - 1| / |1| for E = 1 - rho
 * s, s the row sums of F, for which B = 1. row_sums [n] by element. Cost: some products with F. Errors:
 * LAM_ERR_MEMORY, those of rows. */
lam_status self_check(const build_problem *problem, const double *row_sums, const lam_operator *op,
                      uint64_t seed, build_report *report, lam_error *error);

#endif
