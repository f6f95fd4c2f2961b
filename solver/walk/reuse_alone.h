/* Paths of their own for every position of a light (approach A), private to reuse*.c. */
#ifndef LAMBERT_WALK_REUSE_ALONE_H
#define LAMBERT_WALK_REUSE_ALONE_H

#include "solver/walk/light_frames.h"
#include "solver/walk/reuse.h"

/* Fills estimates that the caller has allocated, with n, C, s and paths set: as many for each position.
 * Memory: 8 n s ((T + 2) (C + 1)) bytes for T threads. Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status reuse_alone(const walk_scene *s, const reuse_problem *problem, const light_pieces *pieces,
                       walk_run *run, reuse_estimates *e, lam_error *error);

#endif
