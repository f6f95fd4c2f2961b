/* Visibility segments of pairs whose occlusion tests suffice for the accuracy of their factors, or saw
 * nothing, where one of the two elements sees so little that the pair is a part of its light. Knows no scene.
 */
#ifndef LAMBERT_FORMFACTOR_PAIRS_PAIR_DEMAND_H
#define LAMBERT_FORMFACTOR_PAIRS_PAIR_DEMAND_H

#include "solver/formfactor/pairs/pair_rows.h"

/* The standard error of N segments is SEGMENTS_ERROR g N^-SEGMENTS_POWER (occlusion.h): the pair i, j with
 * the unoccluded exchange area g has N = (SEGMENTS_ERROR g / (level L))^(1 / SEGMENTS_POWER), at most
 * DEMAND_MOST, so that it is `level` of L, the lesser of what i and j see: seen_i = sum over j of A_i F_ij.
 * An element that sees less than a thousandth of its hemisphere counts as one that sees so much. All zero:
 * no pair demands any. Freed by pair_demand_free. */
enum { DEMAND_MOST = 1024 };
typedef struct pair_demand {
    double level;
    double *light; /* [n], the larger of seen_i and A_i / 1000 */
} pair_demand;

/* order: position to element, as of pair_rows_gather; states and exchange areas are those of occlusion tests.
 * level is 1e-5, or so much that pairs cost about as `budget` segments more do. Depends on no number of
 * threads. Cost: O(number of pairs). Errors: LAM_ERR_MEMORY, after which *out is untouched. */
lam_status pair_demand_find(const pair_rows *rows, const uint32_t *order, const double *area, double budget,
                            pair_demand *out, lam_error *error);
void pair_demand_free(pair_demand *d);

/* N of a pair; 0 where the segments of an occlusion test are as many. */
double pair_demand_of(const pair_demand *d, uint32_t i, uint32_t j, double g);

#endif
