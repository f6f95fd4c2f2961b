/* Reuse by walks that start from elements, private to reuse*.c. */
#ifndef LAMBERT_WALK_REUSE_ELEMENTS_H
#define LAMBERT_WALK_REUSE_ELEMENTS_H

#include "solver/walk/reuse.h"

/* Fills estimates that the caller has allocated, with n, C, s and paths set. Memory: 8 n s ((T + 2) C + 4)
 * bytes. Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status reuse_elements(const walk_scene *s, const reuse_problem *problem, reuse_estimates *e,
                          lam_error *error);

#endif
