#include "solver/formfactor/sight/shadow_cut.h"

#include "solver/base/vector3.h"

#include <math.h>
#include <string.h>

/* Corners of a part, and parts, at most. */
enum { PART_CORNERS = 20, PARTS_MOST = 48 };

/* A convex part of the target. */
typedef struct part {
    int n;
    double s[PART_CORNERS], t[PART_CORNERS];
} part;

typedef struct part_list {
    int n;
    part of[PARTS_MOST];
} part_list;

/* A half plane of the target: inside where at + along s + across t > 0, on its line within rounding. */
typedef struct half_plane {
    double at, along, across, rounding;
} half_plane;

static const double pi = 3.14159265358979323846;

/* The plane through x, p and q has the normal (p - x) x (q - x) = p x q - x x (q - p). */
static void set_plane(cone_plane *plane, const shadow_cut *c, const double p[3], const double q[3]) {
    double along[3];
    cross3(p, q, plane->none);
    subtract3(q, p, along);
    cross3(along, c->e1, plane->one);
    cross3(along, c->e2, plane->two);
    plane->one[3] = dot3(plane->none, c->e1);
    plane->two[3] = dot3(plane->none, c->e2);
}

void shadow_cut_init(shadow_cut *c, const occluders *o, const pair_occluders *among, const polygon *target) {
    double first[3];
    memcpy(c->origin, target->corner[0], sizeof c->origin);
    subtract3(target->corner[1], target->corner[0], first);
    /* A clipped polygon may begin with two equal corners. */
    for (int k = 2; k < target->n && !(dot3(first, first) > 0); k++)
        subtract3(target->corner[k], target->corner[0], first);
    const double length = sqrt(dot3(first, first));
    for (int d = 0; d < 3; d++) c->e1[d] = first[d] / length;
    cross3(target->normal, c->e1, c->e2);
    c->radius = 2 * target->radius;
    c->n = target->n;
    c->n_cones = among->count;
    for (int k = 0; k < c->n; k++) {
        double to[3];
        subtract3(target->corner[k], c->origin, to);
        c->s[k] = dot3(to, c->e1);
        c->t[k] = dot3(to, c->e2);
    }
    c->rounding = 1e-12 * c->radius;
    for (int k = 0; k < c->n_cones; k++) {
        c->order[k] = k;
        const occluder *one = &o->of[among->of[k]];
        shadow_cone *cone = &c->cone[k];
        double corner[OCCLUDER_CORNERS][3];
        cone->n = one->n;
        memcpy(cone->normal, one->normal, sizeof cone->normal);
        cone->level = one->level - dot3(one->normal, c->origin);
        cone->along[0] = dot3(one->normal, c->e1);
        cone->along[1] = dot3(one->normal, c->e2);
        cone->low = INFINITY, cone->high = -INFINITY;
        for (int v = 0; v < c->n; v++) {
            const double height = cone->along[0] * c->s[v] + cone->along[1] * c->t[v] - cone->level;
            cone->low = fmin(cone->low, height);
            cone->high = fmax(cone->high, height);
        }
        for (int e = 0; e < one->n; e++) subtract3(one->corner[e], c->origin, corner[e]);
        for (int e = 0; e < one->n; e++) set_plane(&cone->plane[e], c, corner[e], corner[(e + 1) % one->n]);
    }
}

static half_plane half_plane_of(double at, double along, double across, double radius) {
    return (half_plane){at, along, across, 1e-13 * (fabs(at) + (fabs(along) + fabs(across)) * radius)};
}

static double place_in(const half_plane *h, double s, double t) {
    return h->at + h->along * s + h->across * t;
}

/* Cuts a part: inside keeps what lies in the half plane, outside the rest; either may be empty. */
static bool cut(const part *p, const half_plane *h, part *inside, part *outside) {
    double place[PART_CORNERS];
    inside->n = outside->n = 0;
    if (p->n + 2 > PART_CORNERS) return false;
    for (int k = 0; k < p->n; k++) place[k] = place_in(h, p->s[k], p->t[k]);
    for (int k = 0; k < p->n; k++) {
        const int next = k + 1 < p->n ? k + 1 : 0;
        const bool in = place[k] > h->rounding, out = place[k] < -h->rounding;
        if (!out) {
            inside->s[inside->n] = p->s[k];
            inside->t[inside->n++] = p->t[k];
        }
        if (!in) {
            outside->s[outside->n] = p->s[k];
            outside->t[outside->n++] = p->t[k];
        }
        if ((in && place[next] < -h->rounding) || (out && place[next] > h->rounding)) {
            const double f = place[k] / (place[k] - place[next]);
            const double s = p->s[k] + f * (p->s[next] - p->s[k]), t = p->t[k] + f * (p->t[next] - p->t[k]);
            inside->s[inside->n] = outside->s[outside->n] = s;
            inside->t[inside->n++] = outside->t[outside->n++] = t;
        }
    }
    return true;
}

/* The cone from x over an occluder, beyond the occluder's plane, as half planes of the target; 0: no part of
 * the target is in it. */
static int cone_of(const shadow_cut *c, const shadow_cone *o, const double x[3],
                   half_plane out[OCCLUDER_CORNERS + 1]) {
    const double height = dot3(o->normal, x) - o->level;
    const double side = height > 0 ? 1 : -1;
    int n = 0;
    if (!(fabs(height) > c->rounding)) return 0;
    if (side > 0 ? o->low >= -c->rounding : o->high <= c->rounding) return 0;
    /* x sees the corners counter-clockwise where it is on the side of the normal: then the planes' normals
     * point outwards. */
    for (int e = 0; e < o->n; e++) {
        const cone_plane *p = &o->plane[e];
        out[n++] = half_plane_of(side * dot3(x, p->none), -side * (p->one[3] - dot3(x, p->one)),
                                 -side * (p->two[3] - dot3(x, p->two)), c->radius);
    }
    if (side > 0 ? o->high > 0 : o->low < 0)
        out[n++] = half_plane_of(side * o->level, -side * o->along[0], -side * o->along[1], c->radius);
    return n;
}

static bool is_outside(const part *p, const half_plane *h) {
    for (int k = 0; k < p->n; k++)
        if (place_in(h, p->s[k], p->t[k]) > h->rounding) return false;
    return true;
}

/* Adds to the list what of a part lies outside of a cone; false where there is no room. */
static bool subtract_cone(const part *p, const half_plane *cone, int n, part_list *list) {
    part rest[2];
    for (int h = 0; h < n; h++) {
        if (!is_outside(p, &cone[h])) continue;
        if (list->n == PARTS_MOST) return false;
        list->of[list->n++] = *p;
        return true;
    }
    rest[0] = *p;
    for (int h = 0, now = 0; h < n; h++, now = 1 - now) {
        if (list->n == PARTS_MOST || !cut(&rest[now], &cone[h], &rest[1 - now], &list->of[list->n]))
            return false;
        if (list->of[list->n].n >= 3) list->n++;
        if (rest[1 - now].n < 3) break;
    }
    return true;
}

/* angle / sin(angle) of two vectors, over their lengths: angle / |u x v|. For small angles the series of
 * arcsin(z)/z, whose rest is below 1e-11. */
static double angle_over_sine(double cross2, double inner, double uu, double vv) {
    const double z2 = cross2 / (uu * vv);
    if (inner > 0 && z2 < .05)
        return (1 + z2 * (1. / 6 +
                          z2 * (3. / 40 + z2 * (5. / 112 + z2 * (35. / 1152 +
                                                                 z2 * (63. / 2816 + z2 * 231. / 13312)))))) /
               sqrt(uu * vv);
    const double sine = sqrt(cross2);
    return sine > 0 ? atan2(sine, inner) / sine : 0;
}

/* Lambert's formula: sum over edges of angle times (u x v) . n / |u x v|, over 2 pi. base: the origin seen
 * from x. The corners run clockwise as x sees n. */
static double part_factor(const shadow_cut *c, const part *p, const double base[3], const double n[3]) {
    double corner[PART_CORNERS + 1][3], length2[PART_CORNERS + 1], sum = 0;
    if (p->n < 3) return 0;
    for (int k = 0; k < p->n; k++) {
        for (int d = 0; d < 3; d++) corner[k][d] = base[d] + p->s[k] * c->e1[d] + p->t[k] * c->e2[d];
        length2[k] = dot3(corner[k], corner[k]);
    }
    memcpy(corner[p->n], corner[0], sizeof corner[0]);
    length2[p->n] = length2[0];
    for (int k = 0; k < p->n; k++) {
        double across[3];
        cross3(corner[k], corner[k + 1], across);
        sum -= dot3(across, n) * angle_over_sine(dot3(across, across), dot3(corner[k], corner[k + 1]),
                                                 length2[k], length2[k + 1]);
    }
    return sum / (2 * pi);
}

/* Points of a cell are mostly dark behind the same occluders. */
static void put_first(shadow_cut *c, int at) {
    const int k = c->order[at];
    memmove(c->order + 1, c->order, (size_t)at * sizeof *c->order);
    c->order[0] = k;
}

double shadow_cut_factor(shadow_cut *c, unsigned bits, const double point[3], const double n[3],
                         double *full) {
    part_list lists[2];
    part target = {.n = c->n};
    double x[3], base[3], sum = 0;
    int now = 0;
    bool changed = false;
    for (int d = 0; d < 3; d++) {
        x[d] = point[d] - c->origin[d];
        base[d] = -x[d];
    }
    memcpy(target.s, c->s, (size_t)c->n * sizeof *c->s);
    memcpy(target.t, c->t, (size_t)c->n * sizeof *c->t);
    if (full != NULL) *full = part_factor(c, &target, base, n);
    lists[0].n = 1;
    lists[0].of[0] = target;
    for (int at = 0; at < c->n_cones && lists[now].n > 0; at++) {
        const int k = c->order[at];
        half_plane cone[OCCLUDER_CORNERS + 1];
        if ((bits >> k & 1) == 0) continue;
        const int n_planes = cone_of(c, &c->cone[k], x, cone);
        if (n_planes == 0) continue;
        const part_list *from = &lists[now];
        part_list *to = &lists[1 - now];
        to->n = 0;
        for (int p = 0; p < from->n; p++)
            if (!subtract_cone(&from->of[p], cone, n_planes, to)) return -1;
        changed = changed || to->n != 1 || from->n != 1 || to->of[0].n != from->of[0].n ||
                  memcmp(to->of[0].s, from->of[0].s, (size_t)from->of[0].n * sizeof(double)) != 0 ||
                  memcmp(to->of[0].t, from->of[0].t, (size_t)from->of[0].n * sizeof(double)) != 0;
        now = 1 - now;
        if (to->n == 0) put_first(c, at);
    }
    if (!changed) return full != NULL ? *full : part_factor(c, &target, base, n);
    for (int p = 0; p < lists[now].n; p++) sum += part_factor(c, &lists[now].of[p], base, n);
    return fmin(fmax(sum, 0), full != NULL ? *full : INFINITY);
}
