#include "solver/walk/spherical_triangle.h"

#include "solver/base/vector3.h"

#include <math.h>
#include <string.h>

/* Smaller triangles have angles that rounding decides. */
static const double least_angle = 1e-12;

static void unit_towards(const double from[3], const double to[3], double out[3]) {
    subtract3(to, from, out);
    const double length = sqrt(dot3(out, out));
    for (int d = 0; d < 3; d++) out[d] /= length;
}

/* out = x less its part along the unit vector a, normalized; false where nothing is left. */
static int reject(const double x[3], const double a[3], double out[3]) {
    const double along = dot3(x, a);
    for (int d = 0; d < 3; d++) out[d] = x[d] - along * a[d];
    const double length = sqrt(dot3(out, out));
    if (!(length > 0)) return 0;
    for (int d = 0; d < 3; d++) out[d] /= length;
    return 1;
}

void spherical_triangle_set(const double y[3], const double p[3], const double q[3], const double r[3],
                            spherical_triangle *out) {
    spherical_triangle t;
    double bc[3], to_b[3], to_c[3], across[3];
    unit_towards(y, p, t.a);
    unit_towards(y, q, t.b);
    unit_towards(y, r, t.c);
    cross3(t.b, t.c, bc);
    /* tan (angle / 2) = |a . b x c| / (1 + a.b + b.c + c.a) (Van Oosterom and Strackee 1983) */
    t.cos_c = fmin(fmax(dot3(t.a, t.b), -1), 1);
    t.solid_angle = 2 * atan2(fabs(dot3(t.a, bc)), 1 + t.cos_c + dot3(t.b, t.c) + dot3(t.c, t.a));
    if (!(t.solid_angle > least_angle) || !reject(t.b, t.a, to_b) || !reject(t.c, t.a, to_c))
        t.solid_angle = 0;
    t.alpha = t.cos_alpha = t.sin_alpha = 0;
    if (t.solid_angle > 0) {
        cross3(to_b, to_c, across);
        t.sin_alpha = sqrt(dot3(across, across));
        t.cos_alpha = dot3(to_b, to_c);
        t.alpha = atan2(t.sin_alpha, t.cos_alpha);
    }
    *out = t;
}

void spherical_triangle_direction(const spherical_triangle *t, double u, double w, double out[3]) {
    const double part = u * t->solid_angle - t->alpha, s = sin(part), c = cos(part);
    const double x = c - t->cos_alpha, z = s + t->sin_alpha * t->cos_c;
    const double below = (z * s + x * c) * t->sin_alpha;
    const double q = below != 0 ? fmin(fmax(((z * c - x * s) * t->cos_alpha - z) / below, -1), 1) : 1;
    double side[3], to[3], up[3];
    memcpy(side, t->c, sizeof side);
    if (reject(t->c, t->a, up))
        for (int d = 0; d < 3; d++) side[d] = q * t->a[d] + sqrt(1 - q * q) * up[d];
    const double height = fmin(fmax(1 - w * (1 - dot3(side, t->b)), -1), 1);
    memcpy(to, t->b, sizeof to);
    if (reject(side, t->b, up))
        for (int d = 0; d < 3; d++) to[d] = height * t->b[d] + sqrt(1 - height * height) * up[d];
    memcpy(out, to, sizeof to);
}
