/* Positions below n that were marked, each once, and taken off again in ascending order: for rows whose
 * entries come in any order. What is taken costs its number, beside n / 4096. */
#ifndef LAMBERT_BASE_BITSET_H
#define LAMBERT_BASE_BITSET_H

#include "store/status.h"

#include <stdint.h>
#include <stdlib.h>

typedef struct marks {
    size_t n_groups;
    uint64_t *words;  /* a bit a position */
    uint64_t *groups; /* a bit a word that has any */
    uint32_t *taken;  /* [n], of marks_take */
} marks;

static inline void marks_free(marks *m) {
    free(m->words);
    free(m->groups);
    free(m->taken);
    *m = (marks){.n_groups = 0};
}

/* Freed by marks_free, also after an error. taken has room for `more` numbers beyond n. Errors:
 * LAM_ERR_MEMORY. */
static inline lam_status marks_make(size_t n, size_t more, const char *what, marks *out, lam_error *error) {
    *out = (marks){.n_groups = (n + 4095) / 4096};
    out->words = memory_allocate(out->n_groups * 64, sizeof *out->words, what, error);
    out->groups = memory_allocate(out->n_groups, sizeof *out->groups, what, error);
    out->taken = memory_allocate(n + more, sizeof *out->taken, what, error);
    return out->words != NULL && out->groups != NULL && out->taken != NULL ? LAM_OK : LAM_ERR_MEMORY;
}

static inline void marks_add(marks *m, size_t position) {
    m->words[position >> 6] |= (uint64_t)1 << (position & 63);
    m->groups[position >> 12] |= (uint64_t)1 << (position >> 6 & 63);
}

/* All marked ones go to m->taken and are not marked any more; returns how many. */
static inline size_t marks_take(marks *m) {
    size_t count = 0;
    for (size_t g = 0; g < m->n_groups; g++) {
        for (uint64_t words = m->groups[g]; words != 0; words &= words - 1) {
            const size_t w = g * 64 + (size_t)__builtin_ctzll(words);
            for (uint64_t bits = m->words[w]; bits != 0; bits &= bits - 1)
                m->taken[count++] = (uint32_t)(w * 64 + (size_t)__builtin_ctzll(bits));
            m->words[w] = 0;
        }
        m->groups[g] = 0;
    }
    return count;
}

#endif
