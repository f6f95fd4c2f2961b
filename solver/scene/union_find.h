/* Disjoint sets (union-find): a forest in which the root of a tree represents its set. Initially parent[i] =
 * i. */
#ifndef LAMBERT_SCENE_UNION_FIND_H
#define LAMBERT_SCENE_UNION_FIND_H

#include <stdint.h>

/* The representative of i's set, with path halving. */
static inline uint32_t union_find_root(uint32_t *parent, uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
}

/* Joins the sets of i and j: j's root represents both. */
static inline void union_find_join(uint32_t *parent, uint32_t i, uint32_t j) {
    parent[union_find_root(parent, i)] = union_find_root(parent, j);
}

#endif
