/* Pairs of faces that lie in one plane and cover the same part of it. Knows no light. Private to
 * solver/scene. */
#ifndef LAMBERT_SCENE_COINCIDENT_PAIRS_H
#define LAMBERT_SCENE_COINCIDENT_PAIRS_H

#include "solver/scene/mesh.h"

typedef struct coincident_pair {
    uint32_t first, second; /* faces, first < second */
    bool same;              /* the second has the corners of the first, in the same sequence */
    bool opposite;          /* they look to opposite sides */
    double area;            /* m^2 that both cover */
} coincident_pair;

typedef struct coincident_pairs {
    coincident_pair *pairs;
    size_t n, capacity;
    bool cut; /* the search was ended: there may be more */
} coincident_pairs;

/* When two faces of a mesh lie in one plane. */
typedef struct coincident_planes {
    const mesh *m;
    double distance; /* m: planes, and corners, that are no further apart are one */
    double reach;    /* m: no faces of one plane are further apart, however they were rounded */
} coincident_planes;

/* Cost: O(n). */
coincident_planes coincident_planes_of(const mesh *m);

/* True where the smaller of two faces lies in the plane of the larger one, on either side: as far as rounding
 * to the step of the decimals moves both, if that is less than plane_gap. */
bool coincident_share_plane(const coincident_planes *p, uint32_t i, uint32_t j);

/* m: corners of two faces, and their edges, are one where they are no further apart. */
double coincident_width(const coincident_planes *p, uint32_t i, uint32_t j);

/* Pairs of one side, and of opposite sides where both are to have a back; pairs of either side; or of
 * opposite sides alone. */
typedef enum coincident_sort {
    COINCIDENT_ONE_SIDE,
    COINCIDENT_BOTH_SIDES,
    COINCIDENT_SHEETS
} coincident_sort;

/* Finds the pairs of faces that cover more than a thousandth of the smaller one together. The sequence of
 * pairs depends on the mesh alone. Freed by free(out->pairs). Cost: O(n log n + pairs); ended where it
 * exceeds that by far. Errors: LAM_ERR_MEMORY. */
lam_status coincident_pairs_find(const mesh *m, coincident_sort sort, coincident_pairs *out,
                                 lam_error *error);

#endif
