#include "solver/base/nearest.h"

#include <stdio.h>
#include <string.h>

static size_t smaller(size_t a, size_t b) {
    return a < b ? a : b;
}

/* d(i, j) of the first i bytes of a and the first j of b is the least of d(i-1, j) + 1, d(i, j-1) + 1,
 * d(i-1, j-1) + (a_i != b_j) and, where two neighbours are swapped, d(i-2, j-2) + 1. Returns limit + 1 as
 * soon as no alignment costs at most limit. */
static size_t distance(const char *a, size_t a_length, const char *b, size_t b_length, size_t limit) {
    size_t rows[3][NEAREST_LENGTH_MAX + 1];
    size_t least_before = 0;
    for (size_t j = 0; j <= b_length; j++) rows[0][j] = j;
    for (size_t i = 1; i <= a_length; i++) {
        const size_t *above = rows[(i - 1) % 3], *twice_above = rows[(i + 1) % 3];
        size_t *row = rows[i % 3], least = i;
        row[0] = i;
        for (size_t j = 1; j <= b_length; j++) {
            size_t d = smaller(smaller(above[j], row[j - 1]) + 1, above[j - 1] + (a[i - 1] != b[j - 1]));
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                d = smaller(d, twice_above[j - 2] + 1);
            row[j] = d;
            least = smaller(least, d);
        }
        /* A swap reaches over one row, so two rows above the limit are needed to stop. */
        if (least > limit && least_before > limit) return limit + 1;
        least_before = least;
    }
    return rows[a_length % 3][b_length];
}

const char *nearest_word(const char *word, size_t n, const char *const *words) {
    const char *nearest = NULL;
    const size_t length = strnlen(word, NEAREST_LENGTH_MAX + 1);
    size_t best = NEAREST_LENGTH_MAX;
    if (length > NEAREST_LENGTH_MAX) return NULL;
    for (size_t k = 0; k < n; k++) {
        const size_t other = strnlen(words[k], NEAREST_LENGTH_MAX + 1);
        const size_t longer = other > length ? other : length, limit = smaller(longer / 3, best - 1);
        if (other > NEAREST_LENGTH_MAX || 2 * longer - other - length > limit) continue;
        const size_t d = distance(word, length, words[k], other, limit);
        if (d > limit) continue;
        nearest = words[k];
        best = d;
        if (best == 0) break;
    }
    return nearest;
}

void nearest_advice(const char *word, size_t n, const char *const *words, char *out, size_t size) {
    const char *nearest = nearest_word(word, n, words);
    if (nearest != NULL) {
        snprintf(out, size, "did you mean %s?", nearest);
        return;
    }
    size_t length = (size_t)snprintf(out, size, "must be one of:");
    for (size_t k = 0; k < n && length < size; k++)
        length += (size_t)snprintf(out + length, size - length, " %s", words[k]);
}
