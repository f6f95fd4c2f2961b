#include "solver/operator/wavelet/wavelet_paths.h"

#include <string.h>

/* The first position marked from `from` on; n: there is none. */
static size_t next_mark(const wavelet_plan *plan, const uint64_t *marks, size_t from) {
    const size_t words = wavelet_marks_words(plan);
    size_t word = from / 64;
    if (from >= plan->n) return plan->n;
    uint64_t bits = marks[word] >> from % 64 << from % 64;
    while (bits == 0) {
        if (++word == words) return plan->n;
        bits = marks[word];
    }
    return word * 64 + (size_t)__builtin_ctzll(bits);
}

/* The leaf that takes a position, of leaves from `low` on, which begins before it. Mostly it is the next or
 * near. */
static size_t leaf_from(const wavelet_plan *plan, size_t low, size_t position) {
    size_t high = low + 1, step = 1;
    while (high < plan->n_leaves && plan->steps[plan->leaves[high]].begin <= position) {
        low = high;
        high += step;
        step *= 2;
    }
    if (high > plan->n_leaves) high = plan->n_leaves;
    while (high - low > 1) {
        const size_t middle = low + (high - low) / 2;
        if (plan->steps[plan->leaves[middle]].begin <= position)
            low = middle;
        else
            high = middle;
    }
    return low;
}

/* Lists the flags that are set, eight at a look, and clears them. */
static size_t take_flags(size_t n_steps, uint8_t *flags, uint32_t *out) {
    size_t found = 0;
    for (size_t first = 0; first < n_steps; first += 8) {
        const size_t last = first + 8 < n_steps ? first + 8 : n_steps;
        uint64_t any = 0;
        memcpy(&any, flags + first, last - first);
        for (size_t t = first; any != 0 && t < last; t++)
            if (flags[t] != 0) out[found++] = (uint32_t)t;
        if (any != 0) memset(flags + first, 0, last - first);
    }
    return found;
}

size_t wavelet_plan_paths(const wavelet_plan *plan, const uint64_t *marks, uint8_t *flags, uint32_t *out) {
    size_t leaf = 0, position = next_mark(plan, marks, 0);
    while (position < plan->n) {
        leaf = leaf_from(plan, leaf, position);
        const plan_step *a = &plan->steps[plan->leaves[leaf]];
        for (uint32_t t = plan->leaves[leaf]; t != WAVELET_NONE && flags[t] == 0; t = plan->steps[t].parent)
            flags[t] = 1;
        position = next_mark(plan, marks, (size_t)a->begin + a->count);
    }
    return take_flags(plan->n_steps, flags, out);
}
