/* What an operator makes of light whose answer is known, or can be put to the test. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_SELF_CHECK_H
#define LAMBERT_METHOD_HIERARCHICAL_SELF_CHECK_H

#include "solver/method/method.h"

/* report->probe_residual: |E - (I - R F) B~| / |E| of random light all over, the mean of some; where F is not
 * there by other rows of some elements, and so with their noise. report->uniform_error: |B~ - 1| / |1| of
 * E = 1 - rho s. row_sums [n]: s, of F. Errors: LAM_ERR_MEMORY. */
lam_status self_check(const build_problem *problem, const double *row_sums, const lam_operator *op,
                      uint64_t seed, build_report *report, lam_error *error);

#endif
