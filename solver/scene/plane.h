/* Elementary geometry of planes: turns, distances, axes and triangle areas; and what counts as plane. */
#ifndef LAMBERT_SCENE_PLANE_H
#define LAMBERT_SCENE_PLANE_H

#include <math.h>
#include <stdbool.h>

/* The largest distance of a corner from the plane of a face that counts as plane, in diameters of the face;
 * or from the plane or the edge of another face that it lies in or on, in diameters of the scene. Files of
 * six to nine decimals and of single precision keep it for faces of centimetres and more. */
static const double plane_flatness = 1e-5;
/* Normals of one plane differ by no more than this, 1 - cosine. */
static const double plane_same_direction = 1e-6;
/* Nothing shorter than this share of the extent of a scene is a distance: single precision has 6e-8. */
static const double plane_least_length = 1e-7;
/* Planes closer than this share of the scene's radius are one. Coordinates that were rounded to single
 * precision are off by up to 2^-24 = 6e-8 of the largest of them, which is up to two radii where a scene
 * begins at its origin: two faces that were in one plane are up to 2.4e-7 apart. Rays, in single precision
 * too, meet either of two faces up to 1e-7 to 3e-7 apart, and the nearer one from there on. */
static const double plane_same_place = 1e-6;

/* The distance from which on two faces of these diameters are apart, whatever their corners say. */
static inline double plane_gap(double one, double other) {
    return .01 * fmin(one, other);
}

/* The distance that a corner of one face may have from the plane of another one of the same place, such as
 * the back of a sheet, given both diameters. A quad that counts as plane has corners up to f d off its plane,
 * by turns above and below it, so that each of them is up to 4 f d off the plane of the three others: the
 * back may be made of two triangles. A distance of a hundredth of the smaller face is a gap nevertheless: a
 * diode of a millimetre that hangs .1 mm above a large floor shines on it. */
static inline double plane_slack(double one, double other) {
    return fmin(4 * plane_flatness * fmax(one, other), plane_gap(one, other));
}

/* A flat face: its corners, their mean and the farthest one's distance from that, and the unit normal. */
typedef struct plane_face {
    int n;
    const double (*corner)[3];
    const double *centre, *normal;
    double radius;
} plane_face;

/* The largest distance of the corners of a face from the plane of another one. */
static inline double plane_farthest(const plane_face *of, const plane_face *from) {
    double most = 0;
    for (int c = 0; c < of->n; c++) {
        double height = 0;
        for (int d = 0; d < 3; d++) height += (of->corner[c][d] - from->centre[d]) * from->normal[d];
        most = fmax(most, fabs(height));
    }
    return most;
}

/* The cosine of the angle between the normals of faces of one plane is above this, or below minus this: small
 * faces tilt by rounding, and a face that stands upright on another one is none of its plane. */
static const double plane_parallel = .99;

/* True where two faces lie in one plane, so that neither sees the other: all corners of one of them are
 * within plane_slack of the plane of the other. The one place where that is decided. */
static inline bool plane_is_shared(const plane_face *a, const plane_face *b) {
    double cosine = 0;
    for (int d = 0; d < 3; d++) cosine += a->normal[d] * b->normal[d];
    if (!(fabs(cosine) > plane_parallel)) return false;
    const double slack = plane_slack(2 * a->radius, 2 * b->radius);
    return plane_farthest(a, b) <= slack || plane_farthest(b, a) <= slack;
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
