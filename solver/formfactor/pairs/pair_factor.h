/* The unoccluded form factor of two planar convex polygons by mathematics: no rays, no noise. */
#ifndef LAMBERT_FORMFACTOR_PAIRS_PAIR_FACTOR_H
#define LAMBERT_FORMFACTOR_PAIRS_PAIR_FACTOR_H

#include "solver/formfactor/pairs/polygon.h"

enum { GAUSS_NODES_MOST = 24, GAUSS_RULES = 7, CUBATURE_RULES = 4, STEEP_NODES = 105 };

/* Nodes on [0, 1] and their weights. */
typedef struct gauss_rule {
    int n;
    double node[GAUSS_NODES_MOST], weight[GAUSS_NODES_MOST];
} gauss_rule;

/* Integration rules, made once and then shared by any number of threads. */
typedef struct pair_factor_rules {
    gauss_rule gauss[GAUSS_RULES]; /* 1, 2, 3, 4, 8, 16, 24 nodes */
    /* tanh-sinh (Takahasi and Mori 1974), for integrands that are steep at an end */
    double steep_node[STEEP_NODES], steep_weight[STEEP_NODES];
} pair_factor_rules;

void pair_factor_rules_init(pair_factor_rules *rules);

/* How many radii (of the larger) beyond one the centres of two polygons must be apart for a product rule of
 * nodes x nodes points on either to keep the relative tolerance. */
double pair_factor_distance(int nodes, double tolerance);

/* A_a F_ab = A_b F_ba, m^2, of two polygons with nothing between them: each sees what of the other lies in
 * front of its plane. To the relative tolerance, at best 1e-8 (and 1e-10 of A_a), wherever they lie:
 * touching, crossing one another's planes, or far apart. Contour integral (Sparrow 1963) when near, cubature
 * of the kernel when far. Cost: about 0.1 us far, 1 near, 100 for touching edges that are not parallel. */
double pair_factor_exchange(const pair_factor_rules *rules, const polygon *a, const polygon *b,
                            double tolerance);

#endif
