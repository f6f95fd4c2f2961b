/* Pairs of faces that lie in one plane and cover the same part of it. Knows no light. Private to
 * solver/scene. */
#ifndef LAMBERT_SCENE_COINCIDENT_PAIRS_H
#define LAMBERT_SCENE_COINCIDENT_PAIRS_H

#include "solver/scene/mesh.h"

typedef struct coincident_pair {
    uint32_t first, second; /* faces, first < second */
    bool same;              /* the second has the corners of the first, in the same sequence */
    double area;            /* m^2 that both cover */
} coincident_pair;

typedef struct coincident_pairs {
    coincident_pair *pairs;
    size_t n, capacity;
    bool cut; /* the search was ended: there may be more */
} coincident_pairs;

/* The distance in metres below which two planes, or two corners, are one (coincident_pairs.c). */
double coincident_distance(const mesh *m);

/* Finds the pairs of faces of one side, or, with both_sides, of either side, that cover more than a
 * thousandth of the smaller one together. The sequence of pairs depends on the mesh alone. Freed by
 * free(out->pairs). Cost: O(n log n + pairs); ended where it exceeds that by far. Errors: LAM_ERR_MEMORY. */
lam_status coincident_pairs_find(const mesh *m, bool both_sides, coincident_pairs *out, lam_error *error);

#endif
