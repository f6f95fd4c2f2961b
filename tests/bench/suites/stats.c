#include "tests/bench/suites/stats.h"

#include <math.h>
#include <stdlib.h>

static int ascending(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

double stats_quantile(double *x, size_t n, double q) {
    if (n == 0) return NAN;
    qsort(x, n, sizeof *x, ascending);
    const double at = q * (double)(n - 1);
    const size_t below = (size_t)at;
    if (below + 1 >= n) return x[n - 1];
    return x[below] + (at - (double)below) * (x[below + 1] - x[below]);
}

double stats_median(double *x, size_t n) {
    return stats_quantile(x, n, .5);
}

double stats_mean(const double *x, size_t n) {
    double sum = 0;
    for (size_t i = 0; i < n; i++) sum += x[i];
    return n > 0 ? sum / (double)n : NAN;
}

double stats_cost_at(size_t n, const double *error, const double *cost, double most) {
    double least = INFINITY;
    for (size_t k = 0; k < n; k++) {
        if (!(error[k] <= most)) continue;
        least = fmin(least, cost[k]);
        if (k == 0 || !(error[k - 1] > most && error[k] > 0)) continue;
        const double part = log(error[k - 1] / most) / log(error[k - 1] / error[k]);
        least = fmin(least, cost[k - 1] * pow(cost[k] / cost[k - 1], part));
    }
    return least;
}
