/* What an operator loses by being kept in fewer bits: measured, logged, and weighed against its own error. */
#ifndef LAMBERT_PRECOMPUTE_PRECISION_LOSS_H
#define LAMBERT_PRECOMPUTE_PRECISION_LOSS_H

#include "solver/base/terminal.h"
#include "solver/method/judge.h"

/* Mean of |P' - P|/|P| for the bounced light P, area-weighted, channels stacked. */
typedef struct narrow_loss {
    double single, random; /* one bright element; light all over */
} narrow_loss;

/* Measures it with a few probes of each sort. */
lam_status narrow_measure(const lam_operator *op, const lam_operator *narrow, const double *area,
                          uint64_t seed, narrow_loss *out, lam_error *error);

/* Puts *op, in f32, in another precision in its place and logs what that adds to its error; a kind that has
 * no choice stays as it is. Errors: as operator_narrow. */
lam_status narrow_replace(lam_operator **op, panel_precision precision, const double *area, uint64_t seed,
                          terminal *t, lam_error *error);

/* Logs the narrowest precision that would add less than a tenth of what an operator in f32 is off by already;
 * nothing where there is none, or nothing was measured. */
lam_status narrow_advise(const lam_operator *op, const error_report *errors, const double *area,
                         uint64_t seed, terminal *t, lam_error *error);

#endif
