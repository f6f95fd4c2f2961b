/* Quantiles and means of repeated measurements. */
#ifndef LAMBERT_BENCH_STATS_H
#define LAMBERT_BENCH_STATS_H

#include <stddef.h>

/* The value below which a share q (0 to 1) of x lies, between two values linearly. Sorts x, which holds n
 * finite values; NaN when n is 0. */
double stats_quantile(double *x, size_t n, double q);

/* Sorts x too. */
double stats_median(double *x, size_t n);

double stats_mean(const double *x, size_t n);

/* The least cost of an error of at most `most`, by n settings from coarse to fine: the cost of one of them,
 * or between one that errs by more and the next by powers; infinite where none is fine enough. */
double stats_cost_at(size_t n, const double *error, const double *cost, double most);

#endif
