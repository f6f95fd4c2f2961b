#include "solver/figures/point_figures.h"

#include "solver/base/vector3.h"

#include <math.h>

/* Millimetres are the digits of drawings; and the cosine of .8 degrees. */
static const double same_place = 1e-3, same_way = .9999;

point_figures point_figures_of(size_t n, const double *x) {
    point_figures f = {.min = INFINITY, .max = -INFINITY};
    for (size_t i = 0; i < n; i++) {
        if (isnan(x[i])) continue;
        f.n++;
        f.mean += x[i];
        f.min = fmin(f.min, x[i]);
        f.max = fmax(f.max, x[i]);
    }
    if (f.n == 0) return (point_figures){.mean = NAN, .min = NAN, .max = NAN, .uniformity = NAN};
    f.mean /= (double)f.n;
    f.uniformity = f.mean > 0 ? f.min / f.mean : (double)NAN;
    return f;
}

double point_share(size_t n, const double *x, double least) {
    size_t all = 0, bright = 0;
    for (size_t i = 0; i < n; i++) {
        all += !isnan(x[i]);
        bright += x[i] >= least;
    }
    return all > 0 ? (double)bright / (double)all : (double)NAN;
}

void point_ratios(size_t n, const double *x, const double *y, double *ratio) {
    for (size_t i = 0; i < n; i++) ratio[i] = y[i] > 0 ? x[i] / y[i] : (double)NAN;
}

bool point_is_at(faced_point a, faced_point b) {
    double apart[3];
    subtract3(a.at, b.at, apart);
    return dot3(apart, apart) <= same_place * same_place && dot3(a.axis, b.axis) >= same_way;
}
