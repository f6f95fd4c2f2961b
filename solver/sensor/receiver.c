#include "solver/sensor/receiver.h"

#include "solver/base/receiver_weight.h"
#include "solver/base/vector3.h"
#include "solver/scene/plane.h"

#include <assert.h>
#include <math.h>
#include <string.h>

void receiver_densities(const receiver *harmonic, const double direction[3], double out[HARMONICS]) {
    double own[3];
    harmonics_turn(harmonic->axis, harmonic->look, direction, own);
    harmonics_at(own, out);
    for (int k = 0; k < HARMONICS; k++) out[k] /= M_PI;
}

double receiver_density(const receiver *r, const double direction[3]) {
    return receiver_weight_density((unsigned)r->kind, r->axis, r->look, direction);
}

double receiver_density_most(receiver_kind kind) {
    static const double most[RECEIVER_DENSITIES] = {[RECEIVER_PLANE] = 1 / M_PI,
                                                    [RECEIVER_CYLINDER] = 1 / (M_PI * M_PI),
                                                    [RECEIVER_SEMICYLINDER] = 2 / (M_PI * M_PI),
                                                    [RECEIVER_SPHERE] = 1 / (4 * M_PI)};
    assert(kind < RECEIVER_DENSITIES);
    return most[kind];
}

/* The t of [0, 2 pi] with t - sin t = 2 pi x, by Newton's method within bounds. */
static double cycloid(double x) {
    const double y = 2 * M_PI * x;
    double low = 0, high = 2 * M_PI;
    double t = x < .5 ? cbrt(6 * y) : 2 * M_PI - cbrt(6 * (2 * M_PI - y)); /* t - sin t ~ t^3 / 6 */
    for (int k = 0; k < 60 && high - low > 1e-12; k++) {
        if (!(t > low && t < high)) t = .5 * (low + high);
        const double off = t - sin(t) - y, slope = 1 - cos(t);
        if (off > 0)
            high = t;
        else
            low = t;
        if (fabs(off) < 1e-14) break;
        t -= off / fmax(slope, 1e-9);
    }
    return t;
}

/* The direction at a cosine with the axis and an azimuth about it from u. */
static void turn(const double axis[3], const double u[3], const double w[3], double cosine, double azimuth,
                 double direction[3]) {
    const double sine = sqrt(fmax(0, 1 - cosine * cosine)), along = sine * cos(azimuth),
                 across = sine * sin(azimuth);
    for (int d = 0; d < 3; d++) direction[d] = cosine * axis[d] + along * u[d] + across * w[d];
}

void receiver_direction(const receiver *r, double x, double y, double direction[3]) {
    static const double upwards[3] = {0, 0, 1};
    const double *axis = r->kind == RECEIVER_SPHERE ? upwards : r->axis;
    double u[3], w[3];
    plane_axes(axis, u, w);
    switch (r->kind) {
    case RECEIVER_PLANE:
        turn(axis, u, w, sqrt(fmax(1 - x, 1e-12)), 2 * M_PI * y, direction);
        break;
    /* The share of directions within e of the axis is (e - sin e cos e) / pi, and t = 2 e. */
    case RECEIVER_CYLINDER:
        turn(axis, u, w, cos(cycloid(x) / 2), 2 * M_PI * y, direction);
        break;
    /* The share of azimuths up to a, from -pi, is (a + pi + sin a) / 2 pi, and t = a + pi. */
    case RECEIVER_SEMICYLINDER:
        cross3(axis, r->look, w);
        turn(axis, r->look, w, cos(cycloid(x) / 2), cycloid(y) - M_PI, direction);
        break;
    default:
        turn(axis, u, w, 1 - 2 * x, 2 * M_PI * y, direction);
    }
}

/* The part of a polygon in front of the plane of a receiver; its corners, relative to the receiver. */
static int in_front(const receiver *r, const polygon *p, double out[POLYGON_CORNERS + 1][3]) {
    double height[POLYGON_CORNERS], corner[POLYGON_CORNERS][3];
    int n = 0;
    for (int c = 0; c < p->n; c++) {
        subtract3(p->corner[c], r->at, corner[c]);
        height[c] = dot3(corner[c], r->axis);
    }
    for (int c = 0; c < p->n; c++) {
        const int next = (c + 1) % p->n;
        if (height[c] >= 0) memcpy(out[n++], corner[c], sizeof *out);
        if ((height[c] > 0 && height[next] < 0) || (height[c] < 0 && height[next] > 0)) {
            const double t = height[c] / (height[c] - height[next]);
            for (int d = 0; d < 3; d++) out[n][d] = corner[c][d] + t * (corner[next][d] - corner[c][d]);
            n++;
        }
    }
    return n < 3 ? 0 : n;
}

/* Lambert's sum: 1/(2 pi) sum over edges of the angle of each times the cosine of its own plane's normal. */
static double plane_factor(const receiver *r, const polygon *p) {
    double corner[POLYGON_CORNERS + 1][3], sum = 0;
    const int n = in_front(r, p, corner);
    for (int c = 0; c < n; c++) {
        const double *a = corner[c], *b = corner[(c + 1) % n];
        double cross[3];
        cross3(b, a, cross); /* corners run clockwise as the receiver sees its own normal */
        const double sine = sqrt(dot3(cross, cross));
        if (sine > 0) sum += atan2(sine, dot3(a, b)) * dot3(cross, r->axis) / sine;
    }
    return fmax(sum / (2 * M_PI), 0);
}

/* The solid angle of a triangle (Van Oosterom and Strackee 1983). */
static double solid_angle(const double a[3], const double b[3], const double c[3]) {
    double cross[3];
    const double la = sqrt(dot3(a, a)), lb = sqrt(dot3(b, b)), lc = sqrt(dot3(c, c));
    cross3(b, c, cross);
    const double volume = dot3(a, cross),
                 sum = la * lb * lc + dot3(a, b) * lc + dot3(a, c) * lb + dot3(b, c) * la;
    return 2 * atan2(fabs(volume), sum);
}

static double sphere_factor(const receiver *r, const polygon *p) {
    double corner[POLYGON_CORNERS][3], sum = 0;
    for (int c = 0; c < p->n; c++) subtract3(p->corner[c], r->at, corner[c]);
    for (int c = 1; c + 1 < p->n; c++) sum += solid_angle(corner[0], corner[c], corner[c + 1]);
    return sum / (4 * M_PI);
}

/* Four nodes of Gauss on [0, 1]. */
enum { NODES = 4 };
static const double node[NODES] = {.06943184420297371, .33000947820757187, .66999052179242813,
                                   .93056815579702629};
static const double node_weight[NODES] = {.17392742256872693, .32607257743127307, .32607257743127307,
                                          .17392742256872693};

/* The point of a triangle or a quad at (u, w) of the unit square; returns the Jacobian of the map there. The
 * square is collapsed onto a triangle, as the map of polygon_point is not smooth there. */
static double place(const polygon *p, double u, double w, double point[3]) {
    if (p->n != 3) return polygon_point(p, u, w, point);
    for (int d = 0; d < 3; d++)
        point[d] = p->corner[0][d] + u * ((1 - w) * (p->corner[1][d] - p->corner[0][d]) +
                                          w * (p->corner[2][d] - p->corner[0][d]));
    return 2 * u * triangle_area(p->corner[0], p->corner[1], p->corner[2]);
}

/* density cos / r^2 over a part of a polygon, halved until it is small beside its distance. */
static double quadrature(const receiver *r, const polygon *p, int depth) {
    static const double small = .35; /* radii per distance: four nodes leave 1e-5 */
    enum { HALVINGS = 60 };
    double away[3], sum = 0;
    subtract3(p->centre, r->at, away);
    const double distance = sqrt(dot3(away, away));
    if (p->radius > small * distance && depth < HALVINGS) {
        polygon half[2];
        polygon_halve(p, half);
        return quadrature(r, &half[0], depth + 1) + quadrature(r, &half[1], depth + 1);
    }
    for (int i = 0; i < NODES; i++)
        for (int j = 0; j < NODES; j++) {
            double point[3];
            const double area = place(p, node[i], node[j], point);
            subtract3(point, r->at, away);
            const double square = dot3(away, away), length = sqrt(square);
            if (!(square > 0)) continue;
            for (int d = 0; d < 3; d++) away[d] /= length;
            const double cosine = fmax(-dot3(away, p->normal), 0);
            sum += node_weight[i] * node_weight[j] * area * receiver_density(r, away) * cosine / square;
        }
    return sum;
}

/* True where a polygon has its front towards a receiver. */
static bool is_turned_to(const receiver *r, const polygon *p) {
    double away[3];
    subtract3(r->at, p->centre, away);
    return dot3(away, p->normal) > 0;
}

void receiver_factors(const receiver *harmonic, const polygon *p, double out[HARMONICS]) {
    double corner[POLYGON_CORNERS][3], away[3];
    memset(out, 0, HARMONICS * sizeof *out);
    if (!is_turned_to(harmonic, p)) return;
    for (int c = 0; c < p->n; c++) {
        subtract3(p->corner[c], harmonic->at, away);
        harmonics_turn(harmonic->axis, harmonic->look, away, corner[c]);
    }
    harmonics_of_polygon(p->n, (const double(*)[3])corner, 4 * M_PI * sphere_factor(harmonic, p), out);
    for (int k = 0; k < HARMONICS; k++) out[k] /= M_PI;
}

double receiver_factor(const receiver *r, const polygon *p) {
    if (!is_turned_to(r, p)) return 0;
    if (r->kind >= RECEIVER_HARMONIC) {
        double all[HARMONICS];
        receiver_factors(r, p, all);
        return all[r->kind - RECEIVER_HARMONIC];
    }
    switch (r->kind) {
    case RECEIVER_PLANE:
        return plane_factor(r, p);
    case RECEIVER_SPHERE:
        return sphere_factor(r, p);
    default:
        return quadrature(r, p, 0);
    }
}
