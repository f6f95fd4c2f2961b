/* Pairs of faces whose boxes meet, by a tree of boxes. Knows no planes. Private to solver/scene. */
#ifndef LAMBERT_SCENE_BOX_PAIRS_H
#define LAMBERT_SCENE_BOX_PAIRS_H

#include "solver/scene/mesh.h"

/* Two faces, in no order. The search ends with the first status that is not LAM_OK. */
typedef lam_status box_pair_visit(void *context, uint32_t i, uint32_t j, lam_error *error);

typedef struct box_pairs {
    double distance; /* m: boxes no further apart meet; single precision should be off by less */
    double least;    /* m, at most that distance: they have more than this in common */
    int long_axes;   /* along as many axes at least */
    box_pair_visit *visit;
    void *context;
} box_pairs;

/* Visits each pair of faces whose boxes meet, once. The sequence of pairs depends on the mesh alone. *cut:
 * the search was ended, as it exceeded its cost by far, so that there may be more. Cost: O(n log n + pairs).
 * Errors: LAM_ERR_MEMORY, those of visit. */
lam_status box_pairs_visit(const mesh *m, const box_pairs *how, bool *cut, lam_error *error);

#endif
