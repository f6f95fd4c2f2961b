#include "solver/scene/generate/convex.h"

#include "solver/scene/plane.h"

#include <math.h>
#include <string.h>

double convex_area(const convex *a) {
    double twice = 0;
    for (size_t i = 1; i + 1 < a->n; i++) twice += plane_turn(a->p[0], a->p[i], a->p[i + 1]);
    return twice / 2;
}

/* The shape of a polygon: 1 for a square, less for thinner ones. */
static double shape(const convex *a) {
    double around = 0;
    for (size_t i = 0; i < a->n; i++) around += plane_distance(a->p[i], a->p[(i + 1) % a->n]);
    return around > 0 ? 16 * convex_area(a) / (around * around) : 0;
}

static void append(convex *a, const double p[2]) {
    if (a->n < CONVEX_MOST) memcpy(a->p[a->n++], p, sizeof *a->p);
}

/* The intersection of the segment ab with a line, given the signed distances of both ends. */
static void crossing(const double a[2], double da, const double b[2], double db, double out[2]) {
    if (a[0] > b[0] || (a[0] == b[0] && a[1] > b[1])) { /* the same bits from both sides */
        const double *p = a, d = da;
        a = b, da = db;
        b = p, db = d;
    }
    const double t = da / (da - db);
    for (int k = 0; k < 2; k++) out[k] = a[k] == b[k] ? a[k] : a[k] + t * (b[k] - a[k]);
}

/* The parts of a to the left and to the right of the line from s to e. */
static void cut(const convex *a, const double s[2], const double e[2], convex *left, convex *right) {
    const double length = plane_distance(s, e);
    double side[CONVEX_MOST];
    left->n = right->n = 0;
    for (size_t i = 0; i < a->n; i++) {
        side[i] = plane_turn(s, e, a->p[i]) / length;
        if (fabs(side[i]) < 1e-12) side[i] = 0; /* a corner on the line stays one point */
    }
    for (size_t i = 0; i < a->n; i++) {
        const size_t next = (i + 1) % a->n;
        if (side[i] >= 0) append(left, a->p[i]);
        if (side[i] <= 0) append(right, a->p[i]);
        if (side[i] * side[next] >= 0) continue;
        double p[2];
        crossing(a->p[i], side[i], a->p[next], side[next], p);
        append(left, p);
        append(right, p);
    }
}

size_t convex_subtract(const convex *a, const convex *b, double tiny, convex *pieces) {
    size_t best = 0;
    double best_shape = -1;
    /* The pieces depend on the edge of b that cuts first: chooses the one with the fewest pieces, then with
     * the best worst shape. */
    for (size_t first = 0; first < b->n; first++) {
        convex rest = *a, found[CONVEX_MOST], outside;
        size_t n = 0;
        double worst = 1;
        for (size_t i = 0; i < b->n && rest.n >= 3; i++) {
            const size_t edge = (first + i) % b->n;
            const convex before = rest;
            cut(&before, b->p[edge], b->p[(edge + 1) % b->n], &rest, &outside);
            if (outside.n < 3 || convex_area(&outside) < tiny) {
                rest = before;
                continue;
            }
            worst = fmin(worst, shape(&outside));
            found[n++] = outside;
        }
        if (rest.n < 3 || convex_area(&rest) < tiny) { /* they do not overlap */
            pieces[0] = *a;
            return 1;
        }
        if (best_shape < 0 || n < best || (n == best && worst > best_shape)) {
            memcpy(pieces, found, n * sizeof *found);
            best = n;
            best_shape = worst;
        }
    }
    return best;
}

bool convex_merge(const convex *a, const convex *b, double near, convex *merged) {
    for (size_t i = 0; i < a->n; i++)
        for (size_t j = 0; j < b->n; j++) {
            const size_t i2 = (i + 1) % a->n, j2 = (j + 1) % b->n;
            if (plane_distance(a->p[i], b->p[j2]) > near || plane_distance(a->p[i2], b->p[j]) > near)
                continue;
            convex all = {0}, out = {0};
            for (size_t k = 0; k < a->n; k++) append(&all, a->p[(i2 + k) % a->n]);
            for (size_t k = 2; k < b->n; k++) append(&all, b->p[(j + k) % b->n]);
            if (all.n != a->n + b->n - 2) return false;
            for (size_t k = 0; k < all.n; k++) {
                const double *before = all.p[(k + all.n - 1) % all.n], *after = all.p[(k + 1) % all.n];
                const double off = plane_turn(before, all.p[k], after) / plane_distance(before, after);
                if (off < -near) return false;
                if (off > near) append(&out, all.p[k]);
            }
            if (out.n < 3 || out.n > 4) return false;
            *merged = out;
            return true;
        }
    return false;
}

size_t convex_split(const convex *a, convex *pieces) {
    size_t n = 0;
    convex rest = *a;
    while (rest.n > 4) {
        convex best_quad = {0}, best_rest = {0};
        double best = -1;
        for (size_t i = 0; i < rest.n; i++) {
            convex quad = {0}, other = {0};
            for (size_t k = 0; k < 4; k++) append(&quad, rest.p[(i + k) % rest.n]);
            for (size_t k = 3; k <= rest.n; k++) append(&other, rest.p[(i + k) % rest.n]);
            const double worst = fmin(shape(&quad) * convex_area(&quad), shape(&other) * convex_area(&other));
            if (worst > best) best = worst, best_quad = quad, best_rest = other;
        }
        pieces[n++] = best_quad;
        rest = best_rest;
    }
    pieces[n++] = rest;
    return n;
}
