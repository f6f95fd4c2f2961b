#include "solver/method/low_rank/budget.h"

#include <math.h>

void budget_share(const budget *b, double epsilon, int levels, double p[BUDGET_LEVELS_MOST + 1]) {
    p[0] = levels == 0 ? epsilon : epsilon * sqrt(b->alpha);
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
