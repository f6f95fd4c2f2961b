/* Unoccluded exchange areas of one element with many distant ones at once, by product rules of 4 or 9 points
 * on each element:  A_i F_ij = sum_p sum_q w_p w_q cos cos' / (pi r_pq^2) in vector instructions, for pairs
 * that pair_factor_exchange would treat by its cubature. */
#ifndef LAMBERT_FORMFACTOR_EXCHANGE_PAIR_FAR_H
#define LAMBERT_FORMFACTOR_EXCHANGE_PAIR_FAR_H

#include "solver/formfactor/clusters/clusters.h"
#include "solver/formfactor/exchange/pair_factor.h"

enum { PAIR_FAR_RULES = 2, PAIR_FAR_POINTS_MOST = 9, PAIR_FAR_LANES = 8 };

/* The points and weights of a product rule on every element. */
typedef struct pair_far_points {
    int points;
    double closest; /* least distance of two centres, in radii */
    double *point[PAIR_FAR_POINTS_MOST][3], *weight[PAIR_FAR_POINTS_MOST];
} pair_far_points;

/* The elements in a tree's order, one array for each component: n numbers and padding for one vector. */
typedef struct pair_far_table {
    size_t n, stride;
    double *block; /* holds all arrays below */
    double *centre[3], *normal[3], *radius;
    double *reach;        /* the radius, or beyond everything where no product rule fits the element */
    double *corner[4][3]; /* a triangle's last one twice */
    pair_far_points
        rule[PAIR_FAR_RULES]; /* the one for larger distances first: 4 points per element, then 9 */
} pair_far_table;

/* tolerance is that of pair_factor_exchange. Freed by pair_far_table_free. Errors: LAM_ERR_MEMORY. */
lam_status pair_far_table_build(const polygon *polygons, const cluster_tree *t,
                                const pair_factor_rules *rules, double tolerance, pair_far_table *out,
                                lam_error *error);
void pair_far_table_free(pair_far_table *t);

/* g[k] = A_i F_ij for the positions i and j = first + k, k < count; 0 where they do not face each other or
 * lie in one plane; -1 where the rules do not hold (too close, or partly behind each other) and
 * pair_factor_exchange must be called. */
void pair_far_row(const pair_far_table *t, size_t i, size_t first, size_t count, double *g);

#endif
