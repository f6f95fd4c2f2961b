/* The error that an operator gains by being kept in fewer bits: measured and logged. */
#ifndef LAMBERT_PRECOMPUTE_PRECISION_LOSS_H
#define LAMBERT_PRECOMPUTE_PRECISION_LOSS_H

#include "solver/base/terminal.h"
#include "solver/operator/operator.h"

/* Puts *op, in f32, in another precision in its place and logs what that adds to its error: |P' - P|/|P| of
 * the bounced light P, area-weighted, channels stacked, for some single elements and for some emissions that
 * are random everywhere. A kind that has no choice stays as it is. Errors: as operator_narrow. */
lam_status precision_replace(lam_operator **op, panel_precision precision, const double *area, uint64_t seed,
                             terminal *t, lam_error *error);

#endif
