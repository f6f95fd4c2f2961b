#include "solver/scene/flat_polygon.h"

#include "solver/scene/plane.h"

#include <string.h>

double flat_polygon_area(const flat_polygon *p) {
    double twice = 0;
    for (size_t k = 1; k + 1 < p->n; k++) twice += plane_turn(p->corner[0], p->corner[k], p->corner[k + 1]);
    return .5 * fabs(twice);
}

/* The part of p to the left of the line from a to b. */
static flat_polygon clip(const flat_polygon *p, const double a[2], const double b[2]) {
    flat_polygon out = {.n = 0};
    for (size_t k = 0; k < p->n; k++) {
        const double *from = p->corner[k], *to = p->corner[(k + 1) % p->n];
        const double here = plane_turn(a, b, from), there = plane_turn(a, b, to);
        if (here >= 0 && out.n < FLAT_CORNERS_MOST) memcpy(out.corner[out.n++], from, sizeof out.corner[0]);
        if ((here >= 0) == (there >= 0) || out.n == FLAT_CORNERS_MOST) continue;
        for (int d = 0; d < 2; d++)
            out.corner[out.n][d] = from[d] + here / (here - there) * (to[d] - from[d]);
        out.n++;
    }
    return out;
}

double flat_polygons_overlap(const flat_polygon *a, const flat_polygon *b) {
    flat_polygon both = *a;
    for (size_t k = 0; k < b->n && both.n >= 3; k++)
        both = clip(&both, b->corner[k], b->corner[(k + 1) % b->n]);
    return both.n >= 3 ? flat_polygon_area(&both) : 0;
}
