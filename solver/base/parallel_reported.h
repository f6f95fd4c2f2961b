/* A loop over independent pieces of long work, shared by threads of OpenMP, that reports its progress and
 * ends early where it is cancelled. */
#ifndef LAMBERT_BASE_PARALLEL_REPORTED_H
#define LAMBERT_BASE_PARALLEL_REPORTED_H

#include "solver/base/progress.h"

#include <stddef.h>

/* The place of a loop in its stage: shares of it, from 0 to 1. */
typedef struct reported_loop {
    const progress *progress; /* may be NULL */
    const char *stage;
    double before, part;
} reported_loop;

/* Does pieces first ... last - 1. */
typedef void reported_pieces(const void *job, size_t first, size_t last);

/* Calls run for pieces 0 ... count - 1, at_once of them at a time, in any order and by any thread. Errors:
 * LAM_ERR_CANCELLED; then some pieces are not done. */
lam_status parallel_reported(const reported_loop *loop, size_t count, size_t at_once, reported_pieces *run,
                             const void *job, lam_error *error);

#endif
