/* The part of a plan that some positions need: the steps on the paths from the root to them. */
#ifndef LAMBERT_OPERATOR_WAVELET_WAVELET_PATHS_H
#define LAMBERT_OPERATOR_WAVELET_WAVELET_PATHS_H

#include "solver/operator/wavelet/wavelet_plan.h"

/* Words of a set of positions, a bit each. */
static inline size_t wavelet_marks_words(const wavelet_plan *plan) {
    return plan->n / 64 + 1;
}

static inline void wavelet_mark(uint64_t *marks, size_t position) {
    marks[position / 64] |= (uint64_t)1 << position % 64;
}

/* The steps on the paths from the root to the positions marked, ascending: out has room for n_steps, flags
 * [n_steps] are 0 before and after. Returns their number. Cost: O(steps found) and a look at n / 64 words and
 * n_steps flags. */
size_t wavelet_plan_paths(const wavelet_plan *plan, const uint64_t *marks, uint8_t *flags, uint32_t *out);

#endif
