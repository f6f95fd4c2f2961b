/* The known word that a misspelt one was probably meant to be. */
#ifndef LAMBERT_BASE_NEAREST_H
#define LAMBERT_BASE_NEAREST_H

#include <stddef.h>

/* Longer words have no near one: memory and cost stay bounded whatever a request holds. */
#define NEAREST_LENGTH_MAX 127

/* The word at the least distance from `word`, the first of several; NULL where every distance is above a
 * third of the length of the longer of the two. The distance counts insertions, deletions, substitutions and
 * swaps of two neighbours (the optimal string alignment distance). O(length^2) for each near word, less for
 * others. */
const char *nearest_word(const char *word, size_t n, const char *const *words);

/* Advice after an unknown word: "did you mean NEAREST?", or "must be one of: " and all words where none is
 * near, cut at the size of out. */
void nearest_advice(const char *word, size_t n, const char *const *words, char *out, size_t size);

#endif
