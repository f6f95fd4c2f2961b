/* Line and scatter plots as SVG or PNG: the only room with cairo in it. */
#ifndef LAMBERT_BENCH_PLOT_H
#define LAMBERT_BENCH_PLOT_H

#include "store/status.h"

#include <stdio.h>

/* A point is left out where a coordinate is not finite, or not above 0 on an axis of powers. */
typedef struct plot_series {
    const char *label; /* in the legend */
    size_t n;
    const double *x, *y;      /* [n] */
    const double *low, *high; /* [n], ends of the error bars; NULL: none */
    bool joined;              /* by a line, in the order given */
    bool unmarked;            /* a line only, grey and dashed: a limit, not a measurement */
    bool plain;               /* a line only, in its own colour: a curve of more points than can be marked */
    bool named;               /* its label stands beside its first point */
} plot_series;

enum { PLOT_SERIES_MOST = 12 };

typedef struct plot {
    const char *name; /* of its files */
    const char *title;
    const char *x_label, *y_label; /* with their units */
    bool x_log, y_log;
    const plot_series *series;
    size_t n_series; /* at most PLOT_SERIES_MOST */
} plot;

/* Writes to a stream whose failure is seen by ferror. Errors: LAM_ERR_ARGUMENT when there is no point to
 * draw or too many series, LAM_ERR_MEMORY. */
lam_status plot_svg(const plot *p, FILE *stream, lam_error *error);
lam_status plot_png(const plot *p, FILE *stream, lam_error *error);

#endif
