/* The number of paths that start at each position of a light, private to reuse*.c. */
#ifndef LAMBERT_WALK_REUSE_COUNTS_H
#define LAMBERT_WALK_REUSE_COUNTS_H

#include "store/status.h"

#include <stddef.h>

/* Chooses the parts r_l of paths that start at the s positions, from n first hits of paths that started at
 * all of them alike, with their weights [n][s] for that. Position j of a light whose paths are shared has the
 * variance
 *     J_j(r) ~ sum over hits k of w_kj^2 / sum_l r_l w_kl
 * (the mean square of eq. 2.8, with the density of hits divided out); r minimises sum_j J_j^2, in which large
 * errors weigh more than small ones, by steps r_l <- r_l sqrt(g_l) with the gradient g. Sum and mean of part
 * are s and 1. Errors: LAM_ERR_MEMORY. Cost: O(n s) times the number of steps. */
lam_status reuse_counts(size_t n, size_t s, const float *weight, double *part, lam_error *error);

#endif
