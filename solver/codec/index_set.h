/* A set of numbers that costs what it holds, not what could be in it. */
#ifndef LAMBERT_CODEC_INDEX_SET_H
#define LAMBERT_CODEC_INDEX_SET_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Starts zeroed; freed by index_set_free. Holds anything but UINT32_MAX. */
typedef struct index_set {
    uint32_t *slots; /* [size], a power of two; UINT32_MAX: free */
    size_t size, count;
} index_set;

typedef enum index_set_result { INDEX_SET_ADDED, INDEX_SET_KNOWN, INDEX_SET_NO_MEMORY } index_set_result;

/* O(1) on average. */
index_set_result index_set_add(index_set *set, uint32_t index);

/* Empties it; what it has room for stays, where that is little. */
void index_set_clear(index_set *set);

void index_set_free(index_set *set);

#endif
