/* Elementary geometry of planes: turns, distances, axes, triangle areas, and how plane a face is. */
#ifndef LAMBERT_SCENE_PLANE_H
#define LAMBERT_SCENE_PLANE_H

#include <math.h>

/* The largest distance of a corner from the plane of a planar quad, or from the plane or edge of another face
 * that it lies in or on, for the diameter of the polygon or of the scene: some roundings of six digits. */
static inline double plane_flatness(double diameter) {
    return 1e-5 * diameter;
}

/* Twice the area of the triangle abc; positive when it runs counter-clockwise. */
static inline double plane_turn(const double a[2], const double b[2], const double c[2]) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

static inline double plane_distance(const double a[2], const double b[2]) {
    return hypot(b[0] - a[0], b[1] - a[1]);
}

/* u and w, unit, with u x w = normal, which is unit too: u along the axis farthest from it. */
static inline void plane_axes(const double normal[3], double u[3], double w[3]) {
    const int least = fabs(normal[0]) < fabs(normal[1]) ? (fabs(normal[0]) < fabs(normal[2]) ? 0 : 2)
                                                        : (fabs(normal[1]) < fabs(normal[2]) ? 1 : 2);
    for (int d = 0; d < 3; d++) u[d] = (d == least) - normal[least] * normal[d];
    const double length = sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
    for (int d = 0; d < 3; d++) u[d] /= length;
    w[0] = normal[1] * u[2] - normal[2] * u[1];
    w[1] = normal[2] * u[0] - normal[0] * u[2];
    w[2] = normal[0] * u[1] - normal[1] * u[0];
}

static inline double triangle_area(const double a[3], const double b[3], const double c[3]) {
    double u[3], w[3];
    for (int d = 0; d < 3; d++) {
        u[d] = b[d] - a[d];
        w[d] = c[d] - a[d];
    }
    const double x = u[1] * w[2] - u[2] * w[1], y = u[2] * w[0] - u[0] * w[2], z = u[0] * w[1] - u[1] * w[0];
    return .5 * sqrt(x * x + y * y + z * z);
}

#endif
