#include "solver/method/low_rank/budget.h"

#include <math.h>
#include <string.h>

static const char *const names[] = {"squares", "sums", "frobenius"};

bool budget_rule_find(const char *name, budget_rule *rule) {
    for (size_t k = 0; k < sizeof names / sizeof *names; k++)
        if (strcmp(name, names[k]) == 0) {
            *rule = (budget_rule)k;
            return true;
        }
    return false;
}

const char *budget_rule_name(budget_rule rule) {
    return names[rule];
}

truncation_norm budget_norm(budget_rule rule) {
    return rule == BUDGET_FROBENIUS ? TRUNCATION_FROBENIUS : TRUNCATION_SPECTRAL;
}

static void share_sums(double epsilon, double alpha, int levels, double *p) {
    for (int l = 0; l < levels; l++) {
        p[l] = alpha * epsilon;                    /* e_p */
        epsilon = (1 - alpha) * epsilon / sqrt(2); /* e_ch */
    }
    p[levels] = epsilon;
}

void budget_share(const budget *b, double epsilon, int levels, double p[BUDGET_LEVELS_MOST + 1]) {
    if (b->rule == BUDGET_SUMS || levels == 0) {
        share_sums(epsilon, b->alpha, levels, p);
        return;
    }
    p[0] = epsilon * sqrt(b->alpha);
    for (int l = 1; l <= levels; l++) /* 2^l p_l^2 = (1 - alpha) part_l epsilon^2 */
        p[l] = epsilon * sqrt((1 - b->alpha) * b->part[l] / ldexp(1, l));
}

bool budget_divided(const budget *b) {
    for (int l = 1; l <= BUDGET_LEVELS_MOST; l++)
        if (b->part[l] > 0) return true;
    return false;
}

void budget_divide(budget *b, int levels, double ratio, double leaf) {
    const bool apart = leaf > 0 && levels > 1;
    const int geometric = apart ? levels - 1 : levels;
    double all = 0;
    for (int l = 1; l <= geometric; l++) all += pow(ratio, l);
    for (int l = 0; l <= BUDGET_LEVELS_MOST; l++) {
        b->part[l] = 0;
        if (l > geometric && l <= levels)
            b->part[l] = leaf;
        else if (l > 0 && l <= levels)
            b->part[l] = (apart ? 1 - leaf : 1) * pow(ratio, l) / all;
    }
}
