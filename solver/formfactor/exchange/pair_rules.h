/* The nodes and weights that form factors of pairs are integrated with. */
#ifndef LAMBERT_FORMFACTOR_EXCHANGE_PAIR_RULES_H
#define LAMBERT_FORMFACTOR_EXCHANGE_PAIR_RULES_H

enum { GAUSS_NODES_MOST = 24, GAUSS_RULES = 9, CUBATURE_RULES = 4, STEEP_NODES = 105 };

/* Nodes on [0, 1] and their weights. */
typedef struct gauss_rule {
    int n;
    double node[GAUSS_NODES_MOST], weight[GAUSS_NODES_MOST];
} gauss_rule;

/* Integration rules; immutable after pair_factor_rules_init. */
typedef struct pair_factor_rules {
    gauss_rule gauss[GAUSS_RULES]; /* 1, 2, 3, 4, 6, 8, 12, 16, 24 nodes */
    /* tanh-sinh (Takahasi and Mori 1974), for integrands that are steep at an end */
    double steep_node[STEEP_NODES], steep_weight[STEEP_NODES];
} pair_factor_rules;

void pair_factor_rules_init(pair_factor_rules *rules);

#endif
