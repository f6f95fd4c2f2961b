/* Sums of values by weights: w_t x_t, their mean, what x spreads about a mean, and the places of running
 * sums. */
#ifndef LAMBERT_BASE_WEIGHTED_H
#define LAMBERT_BASE_WEIGHTED_H

#include <stddef.h>

/* sum_t w_t (x_t - mean)^2. */
static inline double weighted_spread(size_t n, const double *w, const float *x, double mean) {
    double sum = 0;
    for (size_t t = 0; t < n; t++) sum += w[t] * ((double)x[t] - mean) * ((double)x[t] - mean);
    return sum;
}

/* sum = sum_t w_t x_t, squares = sum_t (w_t x_t)^2, mean = sum / sum_t w_t (0 where no weight is above 0),
 * and the spread about it. */
typedef struct weighted_sums {
    double sum, squares, mean, spread;
} weighted_sums;

static inline weighted_sums weighted_sums_of(size_t n, const double *w, const float *x) {
    weighted_sums s = {.sum = 0};
    double weight = 0;
    for (size_t t = 0; t < n; t++) {
        const double part = w[t] * (double)x[t];
        weight += w[t];
        s.sum += part;
        s.squares += part * part;
    }
    if (weight > 0) s.mean = s.sum / weight;
    s.spread = weighted_spread(n, w, x, s.mean);
    return s;
}

/* The largest k < n with before[k] <= place, 0 where there is none: the part that a place of a running sum
 * lies in. before [n], rising. Cost: O(log n). */
static inline size_t weighted_part(const double *before, size_t n, double place) {
    size_t low = 0, high = n;
    while (high - low > 1) {
        const size_t middle = low + (high - low) / 2;
        if (before[middle] <= place)
            low = middle;
        else
            high = middle;
    }
    return low;
}

#endif
