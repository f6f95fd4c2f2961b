/* Tests an operator on uniform radiosity, whose answer is known, and on random emission by its residual. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_SELF_CHECK_H
#define LAMBERT_METHOD_HIERARCHICAL_SELF_CHECK_H

#include "solver/method/method.h"

/* report->probe_residual: |E - (I - R F) B~| / |E|, the mean over some random uniform emissions; of streamed
 * F it is estimated from an independent sample of the rows of some elements, with the noise of these.
 * report->uniform_error: |B~ - 1| / |1| for E = 1 - rho s, s the row sums of F [n], for which B = 1. Errors:
 * LAM_ERR_MEMORY. */
lam_status self_check(const build_problem *problem, const double *row_sums, const lam_operator *op,
                      uint64_t seed, build_report *report, lam_error *error);

#endif
