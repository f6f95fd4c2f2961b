/* The unoccluded exchange area of two planar convex polygons by quadrature, without sampling noise:
 *     A_a F_ab = integral integral cos cos' / (pi r^2) = 1/(4 pi) sum over edges of cos(d, d') integral
 * integral ln r^2 the double area integral where they are far apart, the double contour integral (Sparrow
 * 1963) where they are near. */
#ifndef LAMBERT_FORMFACTOR_PAIRS_PAIR_FACTOR_H
#define LAMBERT_FORMFACTOR_PAIRS_PAIR_FACTOR_H

#include "solver/formfactor/pairs/polygon.h"

enum { GAUSS_NODES_MOST = 24, GAUSS_RULES = 7, CUBATURE_RULES = 4, STEEP_NODES = 105 };

/* Nodes on [0, 1] and their weights. */
typedef struct gauss_rule {
    int n;
    double node[GAUSS_NODES_MOST], weight[GAUSS_NODES_MOST];
} gauss_rule;

/* Integration rules; immutable after pair_factor_rules_init. */
typedef struct pair_factor_rules {
    gauss_rule gauss[GAUSS_RULES]; /* 1, 2, 3, 4, 8, 16, 24 nodes */
    /* tanh-sinh (Takahasi and Mori 1974), for integrands that are steep at an end */
    double steep_node[STEEP_NODES], steep_weight[STEEP_NODES];
} pair_factor_rules;

void pair_factor_rules_init(pair_factor_rules *rules);

/* q: a product rule of nodes x nodes points on each polygon keeps the relative tolerance where the centres
 * are 1 + q radii of the larger polygon apart. */
double pair_factor_distance(int nodes, double tolerance);

/* A_a F_ab = A_b F_ba, m^2, without occlusion: only the part of each polygon in front of the other's plane
 * counts. To the relative tolerance, at best 1e-8 (and 1e-10 of A_a), also where they touch or cross one
 * another's planes. Cost: about 0.1 us far, 1 us near, 100 us for touching edges that are not parallel. */
double pair_factor_exchange(const pair_factor_rules *rules, const polygon *a, const polygon *b,
                            double tolerance);

#endif
