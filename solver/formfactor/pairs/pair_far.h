/* Exchange areas of one element with many others at once, where they are far from it: the vector units do for
 * a whole row what pair_factor_exchange does for one pair. */
#ifndef LAMBERT_FORMFACTOR_PAIRS_PAIR_FAR_H
#define LAMBERT_FORMFACTOR_PAIRS_PAIR_FAR_H

#include "solver/formfactor/pairs/clusters.h"
#include "solver/formfactor/pairs/pair_factor.h"

enum { PAIR_FAR_RULES = 2, PAIR_FAR_POINTS_MOST = 9, PAIR_FAR_LANES = 8 };

/* The points of a product rule on every element. */
typedef struct pair_far_points {
    int points;
    double closest; /* radii that two elements must be apart, from middle to middle */
    double *point[PAIR_FAR_POINTS_MOST][3], *weight[PAIR_FAR_POINTS_MOST];
} pair_far_points;

/* The elements in a tree's order, component by component; rows of n numbers and room for one more vector. */
typedef struct pair_far_table {
    size_t n, stride;
    double *block; /* all of the below */
    double *centre[3], *normal[3], *radius;
    double *reach;        /* the radius, or beyond everything where no product rule fits the element */
    double *corner[4][3]; /* a triangle's last one twice */
    pair_far_points rule[PAIR_FAR_RULES]; /* the one for what is further first: 4 points an element, then 9 */
} pair_far_table;

/* tolerance is that of pair_factor_exchange. Freed by pair_far_table_free. */
lam_status pair_far_table_build(const polygon *polygons, const cluster_tree *t,
                                const pair_factor_rules *rules, double tolerance, pair_far_table *out,
                                lam_error *error);
void pair_far_table_free(pair_far_table *t);

/* g[k] = A_i F_ij for the positions i and j = first + k, k < count <= capacity of g, rounded up to
 * PAIR_FAR_LANES; where they do not face each other 0, and where the rule does not hold (too close, or partly
 * behind each other) -1: those are pair_factor_exchange's. */
void pair_far_row(const pair_far_table *t, size_t i, size_t first, size_t count, double *g);

#endif
