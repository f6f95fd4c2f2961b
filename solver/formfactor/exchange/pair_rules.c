#include "solver/formfactor/exchange/pair_rules.h"

#include <math.h>

static const double pi = 3.14159265358979323846;

/* Gauss and Legendre: Newton's iteration for the roots of P_n. */
static void gauss_init(gauss_rule *g, int n) {
    g->n = n;
    for (int k = 0; k < n; k++) {
        double x = cos(pi * (k + .75) / (n + .5)), derivative = 1;
        for (int sweep = 0; sweep < 100; sweep++) {
            double p = 1, before = 0;
            for (int j = 0; j < n; j++) {
                const double next = ((2 * j + 1) * x * p - j * before) / (j + 1);
                before = p;
                p = next;
            }
            derivative = n * (x * p - before) / (x * x - 1);
            const double step = p / derivative;
            x -= step;
            if (fabs(step) < 1e-15) break;
        }
        g->node[k] = .5 * (1 - x);
        g->weight[k] = 1 / ((1 - x * x) * derivative * derivative);
    }
}

void pair_factor_rules_init(pair_factor_rules *rules) {
    static const int nodes[GAUSS_RULES] = {1, 2, 3, 4, 6, 8, 12, 16, 24};
    for (int r = 0; r < GAUSS_RULES; r++) gauss_init(&rules->gauss[r], nodes[r]);
    /* s = 1/(1 + exp(-pi sinh t)), ds = pi cosh t s (1 - s) dt */
    const double step = 1. / 16;
    for (int k = 0; k < STEEP_NODES; k++) {
        const double t = step * (k - STEEP_NODES / 2);
        const double s = 1 / (1 + exp(-pi * sinh(t))), rest = 1 / (1 + exp(pi * sinh(t)));
        rules->steep_node[k] = s;
        rules->steep_weight[k] = step * pi * cosh(t) * s * rest;
    }
}
