/* Exchange areas of one element with many others at once, where they are far from it: the vector units do for
 * a whole row what pair_exchange does for one pair. */
#ifndef LAMBERT_FORMFACTOR_PAIRS_PAIR_FAR_H
#define LAMBERT_FORMFACTOR_PAIRS_PAIR_FAR_H

#include "solver/formfactor/pairs/clusters.h"
#include "solver/formfactor/pairs/pair_factor.h"

enum { FAR_RULES = 2, FAR_POINTS_MOST = 9, FAR_LANES = 8 };

/* The points of a product rule on every element. */
typedef struct far_rule_points {
    int points;
    double closest; /* radii that two elements must be apart, from middle to middle */
    double *point[FAR_POINTS_MOST][3], *weight[FAR_POINTS_MOST];
} far_rule_points;

/* The elements in a tree's order, component by component; rows of n numbers and room for one more vector. */
typedef struct far_table {
    size_t n, stride;
    double *block; /* all of the below */
    double *centre[3], *normal[3], *radius;
    double *reach;        /* the radius, or beyond everything where no product rule fits the element */
    double *corner[4][3]; /* a triangle's last one twice */
    far_rule_points rule[FAR_RULES]; /* the one for what is further first: 4 points an element, then 9 */
} far_table;

/* tolerance is that of pair_exchange. Freed by far_table_free. */
lam_status far_table_build(const polygon *polygons, const cluster_tree *t, const pair_rules *rules,
                           double tolerance, far_table *out, lam_error *error);
void far_table_free(far_table *t);

/* g[k] = A_i F_ij for the positions i and j = first + k, k < count <= capacity of g, rounded up to FAR_LANES;
 * where they do not face each other 0, and where the rule does not hold (too close, or partly behind each
 * other) -1: those are pair_exchange's. */
void far_row(const far_table *t, size_t i, size_t first, size_t count, double *g);

#endif
