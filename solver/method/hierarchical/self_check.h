/* A short test of a finished operator against the form factors that it was built from. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_SELF_CHECK_H
#define LAMBERT_METHOD_HIERARCHICAL_SELF_CHECK_H

#include "solver/method/method.h"

/* Tests op on random and smooth emissions by their residuals r = E - (I - R F) B~, and on uniform radiosity,
 * whose emission is known, and reports
 *     probe_residual   |r| / |E|, the mean over a few random emissions;
 *     smooth_residual  |r| / |R F B~|, the larger of light of half of the area and light that grows along x,
 *                      neither of which was imposed on the operator or corrected;
 *     uniform_error    |B~ - 1| / |1| for E = 1 - rho s, s the row sums of F, for which B = 1.
 * With streamed F only some rows count, of an independent sample, with its noise. report->doubtful is set
 * where smooth_residual is above epsilon / 2 and the noise of F, unless only what some read is wanted.
 * row_sums [n] by element. Cost: some products with F. Errors: LAM_ERR_MEMORY, those of rows. */
lam_status self_check(const build_problem *problem, const double *row_sums, const lam_operator *op,
                      double epsilon, uint64_t seed, build_report *report, lam_error *error);

#endif
