/* What is joined, directly or by way of others: a forest in which the root of a tree stands for all in it.
 * It is empty while parent[i] = i. */
#ifndef LAMBERT_SCENE_UNION_FIND_H
#define LAMBERT_SCENE_UNION_FIND_H

#include <stdint.h>

/* Halves the way on its way, which keeps all later ones short. */
static inline uint32_t union_find_root(uint32_t *parent, uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
}

/* Joins i to j: j's root stands for both. */
static inline void union_find_join(uint32_t *parent, uint32_t i, uint32_t j) {
    parent[union_find_root(parent, i)] = union_find_root(parent, j);
}

#endif
