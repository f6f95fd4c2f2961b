#include "solver/scene/facet/plane_rectangle.h"

#include "solver/base/vector3.h"

#include <math.h>

static double length_of(const double a[3]) {
    return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
}

double plane_rectangle_area(const plane_rectangle *r) {
    return length_of(r->edge[0]) * length_of(r->edge[1]);
}

bool plane_rectangle_around(const double (*points)[3], size_t n, const uint32_t (*edges)[2], size_t n_edges,
                            double flat, plane_rectangle *out) {
    double u[3] = {0}, w[3] = {0}, normal[3], longest = 0, widest = 0, low[2] = {0, 0}, high[2] = {0, 0};
    for (size_t e = 0; e < n_edges; e++) {
        double side[3];
        for (int d = 0; d < 3; d++) side[d] = points[edges[e][1]][d] - points[edges[e][0]][d];
        const double length = length_of(side);
        if (length <= longest) continue;
        longest = length;
        for (int d = 0; d < 3; d++) u[d] = side[d] / length;
    }
    if (!(longest > flat)) return false;
    for (size_t i = 0; i < n; i++) { /* the point that is furthest from the line along u */
        double r[3];
        for (int d = 0; d < 3; d++) r[d] = points[i][d] - points[0][d];
        const double along = dot3(r, u);
        for (int d = 0; d < 3; d++) r[d] -= along * u[d];
        const double width = length_of(r);
        if (width <= widest) continue;
        widest = width;
        for (int d = 0; d < 3; d++) w[d] = r[d] / width;
    }
    if (!(widest > flat)) return false;
    normal[0] = u[1] * w[2] - u[2] * w[1];
    normal[1] = u[2] * w[0] - u[0] * w[2];
    normal[2] = u[0] * w[1] - u[1] * w[0];
    for (size_t i = 0; i < n; i++) {
        double r[3];
        for (int d = 0; d < 3; d++) r[d] = points[i][d] - points[0][d];
        if (fabs(dot3(r, normal)) > flat) return false;
        const double at[2] = {dot3(r, u), dot3(r, w)};
        for (int k = 0; k < 2; k++) {
            low[k] = fmin(low[k], at[k]);
            high[k] = fmax(high[k], at[k]);
        }
    }
    for (int d = 0; d < 3; d++) {
        out->corner[d] = points[0][d] + low[0] * u[d] + low[1] * w[d];
        out->edge[0][d] = (high[0] - low[0]) * u[d];
        out->edge[1][d] = (high[1] - low[1]) * w[d];
    }
    return true;
}
