/* The pace of this machine now: a short trial of the work that operators and judges do most. */
#ifndef LAMBERT_PRECOMPUTE_MACHINE_PACE_H
#define LAMBERT_PRECOMPUTE_MACHINE_PACE_H

#include "store/status.h"

/* *slowness: processor seconds of the trial over those of the machine that constants are of. Multiplies a
 * sparse matrix with a batch of vectors for some hundredths of a second in one thread. Errors:
 * LAM_ERR_MEMORY. */
lam_status machine_slowness_measure(double *slowness, lam_error *error);

#endif
