#include "solver/codec/index_set.h"

#include <stdlib.h>
#include <string.h>

#define LEAST_SIZE ((size_t)64)

/* The slot of an index, or the free one where it belongs: the high bits of a multiplicative hash, then one
 * after the other. At most half of the slots are taken, so that there is one. */
static size_t slot_of(const index_set *set, uint32_t index) {
    size_t at = (size_t)((uint64_t)index * 0x9E3779B97F4A7C15u >> 20) & (set->size - 1);
    while (set->slots[at] != UINT32_MAX && set->slots[at] != index) at = (at + 1) & (set->size - 1);
    return at;
}

static bool grow(index_set *set) {
    index_set larger = {.size = set->size == 0 ? LEAST_SIZE : 2 * set->size};
    larger.slots = malloc(larger.size * sizeof *larger.slots);
    if (larger.slots == NULL) return false;
    memset(larger.slots, 0xff, larger.size * sizeof *larger.slots);
    for (size_t k = 0; k < set->size; k++)
        if (set->slots[k] != UINT32_MAX) larger.slots[slot_of(&larger, set->slots[k])] = set->slots[k];
    larger.count = set->count;
    free(set->slots);
    *set = larger;
    return true;
}

index_set_result index_set_add(index_set *set, uint32_t index) {
    if (2 * set->count >= set->size && !grow(set)) return INDEX_SET_NO_MEMORY;
    const size_t at = slot_of(set, index);
    if (set->slots[at] == index) return INDEX_SET_KNOWN;
    set->slots[at] = index;
    set->count++;
    return INDEX_SET_ADDED;
}

void index_set_clear(index_set *set) {
    /* A batch of short lists behind a long one must not pay for that again with each. */
    if (set->size > 16 * LEAST_SIZE)
        index_set_free(set);
    else if (set->count > 0)
        memset(set->slots, 0xff, set->size * sizeof *set->slots);
    set->count = 0;
}

void index_set_free(index_set *set) {
    free(set->slots);
    *set = (index_set){0};
}
