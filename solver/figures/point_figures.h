/* Figures of the values at a set of points, of which each counts as much. A point without a value has NAN,
 * and is left out. Knows neither scenes nor stores. */
#ifndef LAMBERT_FIGURES_POINT_FIGURES_H
#define LAMBERT_FIGURES_POINT_FIGURES_H

#include <stdbool.h>
#include <stddef.h>

/* All NAN where no point has a value. */
typedef struct point_figures {
    size_t n; /* points with a value */
    double mean, min, max;
    double uniformity; /* U0 = min / mean (EN 12464-1); NAN where the mean is not above 0 */
} point_figures;

point_figures point_figures_of(size_t n, const double *x);

/* The share of the points with a value at which x is at least so much; NAN where there is none. */
double point_share(size_t n, const double *x, double least);

/* ratio [n] of x / y, NAN where y is not above 0 or one has no value: of cylindrical and horizontal
 * illuminances, modelling (EN 12464-1, .3 to .6). It may be x or y. */
void point_ratios(size_t n, const double *x, const double *y, double *ratio);

/* A place and the way that a point faces there, or its axis. */
typedef struct faced_point {
    const double *at, *axis; /* [3], m; a unit vector */
} faced_point;

/* True where two points are at one place, to a millimetre, and face the same way. */
bool point_is_at(faced_point a, faced_point b);

#endif
