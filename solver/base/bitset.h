/* A set of positions below n that gives them back in ascending order, for rows whose entries come in any
 * order. Taking c positions costs O(c + n / 4096). */
#ifndef LAMBERT_BASE_BITSET_H
#define LAMBERT_BASE_BITSET_H

#include "store/status.h"

#include <stdint.h>
#include <stdlib.h>

typedef struct bitset {
    size_t n_groups;
    uint64_t *words;  /* a bit for each position */
    uint64_t *groups; /* a bit for each word, set when the word is not 0 */
    uint32_t *taken;  /* [n], filled by bitset_take */
} bitset;

static inline void bitset_free(bitset *b) {
    free(b->words);
    free(b->groups);
    free(b->taken);
    *b = (bitset){.n_groups = 0};
}

/* The caller frees with bitset_free, also after an error. taken has room for `more` numbers beyond n. Errors:
 * LAM_ERR_MEMORY. */
static inline lam_status bitset_make(size_t n, size_t more, const char *what, bitset *out, lam_error *error) {
    *out = (bitset){.n_groups = (n + 4095) / 4096};
    out->words = memory_allocate(out->n_groups * 64, sizeof *out->words, what, error);
    out->groups = memory_allocate(out->n_groups, sizeof *out->groups, what, error);
    out->taken = memory_allocate(n + more, sizeof *out->taken, what, error);
    return out->words != NULL && out->groups != NULL && out->taken != NULL ? LAM_OK : LAM_ERR_MEMORY;
}

static inline void bitset_add(bitset *b, size_t position) {
    b->words[position >> 6] |= (uint64_t)1 << (position & 63);
    b->groups[position >> 12] |= (uint64_t)1 << (position >> 6 & 63);
}

/* Moves all positions to b->taken, which empties the set, and returns how many they are. */
static inline size_t bitset_take(bitset *b) {
    size_t count = 0;
    for (size_t g = 0; g < b->n_groups; g++) {
        for (uint64_t words = b->groups[g]; words != 0; words &= words - 1) {
            const size_t w = g * 64 + (size_t)__builtin_ctzll(words);
            for (uint64_t bits = b->words[w]; bits != 0; bits &= bits - 1)
                b->taken[count++] = (uint32_t)(w * 64 + (size_t)__builtin_ctzll(bits));
            b->words[w] = 0;
        }
        b->groups[g] = 0;
    }
    return count;
}

#endif
