/* A scene and all that its pairs are found and tested with, those of all of it and those of a sample of its
 * links. Knows no rows. */
#ifndef LAMBERT_FORMFACTOR_PAIRS_PAIR_GROUND_H
#define LAMBERT_FORMFACTOR_PAIRS_PAIR_GROUND_H

#include "solver/formfactor/exchange/pair_far.h"
#include "solver/formfactor/pairs/few_occluders.h"
#include "solver/formfactor/pairs/pairs.h"
#include "solver/formfactor/sight/occlusion.h"

typedef struct pair_ground {
    const mesh *m;
    const pairs_options *options;
    pair_factor_rules rules;
    polygon *polygons; /* [n], by element */
    occlusion occlusion;
    few_occluders few;
    bool projects; /* pairs with few occluders */
    bool lists;    /* the occluders of pairs, whose segments are tested against them */
    cluster_tree tree;
    pair_far_table far;
    cluster_links links;
} pair_ground;

/* Links are all of them, or those of one part of the descent of `one_of`. m, v and options must outlive it,
 * which must stay where it is: parts of it refer to others. Freed by pair_ground_free, after an error, too.
 * Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status pair_ground_find(const mesh *m, const visibility *v, const pairs_options *options, size_t one_of,
                            pair_ground *out, lam_error *error);
void pair_ground_free(pair_ground *g);

/* True where a pair of links that are projected is so itself; else its few occluders prove it open or hidden,
 * or it is tested by segments. At the accuracies of operators that leave much out, eight segments are enough
 * for small factors: in rooms of 6,004 elements they take 2.5 s in place of 6.7 with projection, at the same
 * error of an operator at epsilon .05. */
bool pair_ground_projects(const pair_ground *g, uint32_t i, uint32_t j, double exchange);

#endif
