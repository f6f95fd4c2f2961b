/* Converged references for the judge, some of them with the help of the operator that is judged. */
#ifndef LAMBERT_METHOD_GUIDED_REFERENCE_H
#define LAMBERT_METHOD_GUIDED_REFERENCE_H

#include "solver/method/reference.h"
#include "solver/operator/operator.h"

/* B of m emissions in one channel, both [m][n], B a guess on entry, to four digits below the smallest error
 * worth printing. An LU is solved by itself; an iteration has op as the guide of reference_solve_guided,
 * unless op answers only to emitters. Errors: those of
 * reference_solve_guided. */
lam_status guided_reference_solve(const reference *r, const factor_product *F, const lam_operator *op,
                                  size_t channel, size_t m, const double *E, double *B, const progress *p,
                                  lam_error *error);

#endif
