/* Disjoint sets (union-find): a forest in which the root of a tree represents its set, its smallest member.
 * Initially parent[i] = i. */
#ifndef LAMBERT_BASE_UNION_FIND_H
#define LAMBERT_BASE_UNION_FIND_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* The representative of i's set, with path halving. */
static inline uint32_t union_find_root(uint32_t *parent, uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
}

/* Joins the sets of i and j; false where they are one already. */
static inline bool union_find_join(uint32_t *parent, uint32_t i, uint32_t j) {
    const uint32_t a = union_find_root(parent, i), b = union_find_root(parent, j);
    parent[a > b ? a : b] = a > b ? b : a;
    return a != b;
}

/* Turns parent [n] into the number of each member's set, counted from 0 by their first members; returns how
 * many there are. */
static inline size_t union_find_number(uint32_t *parent, size_t n) {
    size_t count = 0;
    /* Every parent is smaller, so that it has its number already. */
    for (size_t i = 0; i < n; i++) parent[i] = parent[i] == i ? (uint32_t)count++ : parent[parent[i]];
    return count;
}

#define UNION_FIND_ALONE UINT32_MAX

/* The numbers [n] are as above: those of sets of one member become UNION_FIND_ALONE. sizes: room for as many
 * numbers as there are sets. */
static inline void union_find_mark_alone(uint32_t *number, size_t n, size_t n_sets, uint32_t *sizes) {
    for (size_t k = 0; k < n_sets; k++) sizes[k] = 0;
    for (size_t i = 0; i < n; i++) sizes[number[i]]++;
    for (size_t i = 0; i < n; i++)
        if (sizes[number[i]] == 1) number[i] = UNION_FIND_ALONE;
}

#endif
