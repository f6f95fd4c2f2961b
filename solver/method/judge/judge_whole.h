/* The errors of whole groups that emit evenly, alone and together (group_errors, whole_rms). Private to
 * judge.c.
 */
#ifndef LAMBERT_METHOD_JUDGE_WHOLE_H
#define LAMBERT_METHOD_JUDGE_WHOLE_H

#include "solver/method/judge/judge_by_group.h"

/* The most groups that are judged as themselves (judge_whole_most), and those that are so for being large. */
enum { WHOLE_MOST = 64, WHOLE_LARGE = 8 };

/* Fills n_whole, whole_groups, whole_rms and whole_mean of `to` from the probes `each` [count] of groups
 * [count] that emit 1 in every channel. bins: any sums that were begun. Where noise is little it is taken out
 * (square_without_noise). Cost: O(C n count^2). Errors: LAM_ERR_MEMORY, after which `to` is as before. */
lam_status whole_errors(size_t count, const figure_probe *each, const uint32_t *groups,
                        const by_group_sums *bins, group_errors *to, lam_error *error);

#endif
