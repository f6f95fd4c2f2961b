#include "solver/formfactor/sight/pair_occluders.h"

#include "solver/base/vector3.h"
#include "solver/scene/plane.h"

#include <math.h>
#include <string.h>

/* Planes through an edge of one polygon and a corner of the other. */
enum { SUPPORTS_MOST = 2 * POLYGON_CORNERS };

typedef struct supports {
    int n;
    double normal[SUPPORTS_MOST][3], level[SUPPORTS_MOST]; /* a point with normal . x > level is outside */
} supports;

typedef struct pair_sides {
    const polygon *side[2];
    double rise[2]; /* of faces of its plane above each side, which block nothing of it */
    double slack;
    bool has_supports;
    supports supports;
} pair_sides;

/* The plane through an edge of p and a corner of q that has both wholly on one side, if there is one. */
static void add_support(supports *s, const polygon *p, int edge, const polygon *q, double slack) {
    const double *from = p->corner[edge], *to = p->corner[(edge + 1) % p->n];
    double along[3];
    subtract3(to, from, along);
    for (int c = 0; c < q->n; c++) {
        double across[3], normal[3], to_centre[3];
        subtract3(q->corner[c], from, across);
        cross3(along, across, normal);
        const double length = sqrt(dot3(normal, normal));
        if (!(length > slack * slack)) continue;
        subtract3(p->centre, from, to_centre);
        const double sign = dot3(normal, to_centre) > 0 ? -1 : 1;
        for (int d = 0; d < 3; d++) normal[d] *= sign / length;
        const double level = dot3(normal, from);
        bool all = true;
        for (int k = 0; k < q->n && all; k++) all = dot3(normal, q->corner[k]) - level <= slack;
        if (!all) continue;
        memcpy(s->normal[s->n], normal, sizeof normal);
        s->level[s->n++] = level;
        return;
    }
}

static bool is_outside(pair_sides *p, const occluder *o) {
    if (!p->has_supports) {
        p->has_supports = true;
        p->supports.n = 0;
        for (int side = 0; side < 2; side++)
            for (int e = 0; e < p->side[side]->n; e++)
                add_support(&p->supports, p->side[side], e, p->side[1 - side], p->slack);
    }
    for (int k = 0; k < p->supports.n; k++) {
        bool outside = true;
        for (int c = 0; c < o->n && outside; c++)
            outside = dot3(p->supports.normal[k], o->corner[c]) >= p->supports.level[k] - p->slack;
        if (outside) return true;
    }
    return false;
}

/* The segments between two spheres lie within `radius` of that between their centres. */
typedef struct capsule {
    double from[3], along[3], length2, radius;
} capsule;

static capsule capsule_of(const pair_sides *p) {
    capsule c = {.radius = fmax(p->side[0]->radius, p->side[1]->radius) + p->slack};
    memcpy(c.from, p->side[0]->centre, sizeof c.from);
    subtract3(p->side[1]->centre, c.from, c.along);
    c.length2 = fmax(dot3(c.along, c.along), p->slack * p->slack);
    return c;
}

static bool capsule_misses(const capsule *c, const occluder *o) {
    double to[3];
    subtract3(o->middle, c->from, to);
    const double part = fmin(fmax(dot3(to, c->along) / c->length2, 0), 1), reach = c->radius + o->radius;
    for (int d = 0; d < 3; d++) to[d] -= part * c->along[d];
    return dot3(to, to) > reach * reach;
}

typedef enum standing { STANDS_BESIDE, STANDS_BETWEEN, STANDS_BEFORE_ALL } standing;

/* Where the two elements lie on different sides of the occluder's plane, the segments between their corners
 * cross it in points whose hull holds those of all other segments. */
static standing compare_crossings(const occluder *o, const polygon *a, const polygon *b,
                                  const double height[2][POLYGON_CORNERS], double slack) {
    double least[OCCLUDER_CORNERS], most[OCCLUDER_CORNERS];
    for (int e = 0; e < o->n; e++) least[e] = INFINITY, most[e] = -INFINITY;
    for (int i = 0; i < a->n; i++)
        for (int j = 0; j < b->n; j++) {
            const double t = height[0][i] / (height[0][i] - height[1][j]);
            double at[3];
            for (int d = 0; d < 3; d++) at[d] = a->corner[i][d] + t * (b->corner[j][d] - a->corner[i][d]);
            for (int e = 0; e < o->n; e++) {
                const double inside = dot3(o->edge[e], at) + o->edge[e][3];
                least[e] = inside < least[e] ? inside : least[e];
                most[e] = inside > most[e] ? inside : most[e];
            }
        }
    bool all = true;
    for (int e = 0; e < o->n; e++) {
        if (most[e] <= slack) return STANDS_BESIDE;
        all = all && least[e] >= -slack;
    }
    return all ? STANDS_BEFORE_ALL : STANDS_BETWEEN;
}

bool occluder_in_contact(const occluder *o, const polygon *element, double rise, double slack) {
    double top = -INFINITY, most = 0;
    if (!(rise > 0)) return false;
    for (int c = 0; c < o->n; c++) {
        double to[3];
        subtract3(o->corner[c], element->centre, to);
        top = fmax(top, dot3(element->normal, to));
    }
    for (int c = 0; c < element->n; c++)
        most = fmax(most, fabs(dot3(o->normal, element->corner[c]) - o->level));
    return top <= slack + rise ||
           (most <= slack + rise && fabs(dot3(o->normal, element->normal)) > plane_parallel);
}

/* All points are outside of one edge of the other, give or take slack. */
static bool apart_in_plane(const occluder *o, const polygon *element, double slack) {
    for (int e = 0; e < o->n; e++) {
        bool outside = true;
        for (int c = 0; c < element->n && outside; c++)
            outside = dot3(o->edge[e], element->corner[c]) + o->edge[e][3] <= slack;
        if (outside) return true;
    }
    for (int e = 0; e < element->n; e++) {
        double along[3], inwards[3];
        subtract3(element->corner[(e + 1) % element->n], element->corner[e], along);
        cross3(element->normal, along, inwards);
        const double most = slack * sqrt(dot3(inwards, inwards));
        bool outside = true;
        for (int c = 0; c < o->n && outside; c++) {
            double to[3];
            subtract3(o->corner[c], element->corner[e], to);
            outside = dot3(inwards, to) <= most;
        }
        if (outside) return true;
    }
    return false;
}

bool occluder_lies_beside(const occluder *o, const polygon *element, double slack) {
    if (!(fabs(dot3(o->normal, element->normal)) > plane_parallel)) return false;
    const double most = plane_slack(2 * o->radius, 2 * element->radius);
    int in_plane = 0;
    for (int c = 0; c < element->n; c++) {
        const double height = fabs(dot3(o->normal, element->corner[c]) - o->level);
        if (!(height <= most)) return false;
        in_plane += height <= 2 * slack; /* the plane is that of all corners that were joined */
    }
    return (o->facet == MESH_NO_VERTEX && in_plane >= 3) || apart_in_plane(o, element, most);
}

static standing where_it_stands(pair_sides *p, const occluder *o) {
    double height[2][POLYGON_CORNERS], low[2], high[2];
    for (int side = 0; side < 2; side++) {
        const polygon *one = p->side[side];
        low[side] = INFINITY, high[side] = -INFINITY;
        for (int c = 0; c < one->n; c++) {
            height[side][c] = dot3(o->normal, one->corner[c]) - o->level;
            low[side] = height[side][c] < low[side] ? height[side][c] : low[side];
            high[side] = height[side][c] > high[side] ? height[side][c] : high[side];
        }
    }
    if (!(low[0] < -p->slack && high[1] > p->slack) && !(low[1] < -p->slack && high[0] > p->slack))
        return STANDS_BESIDE;
    for (int side = 0; side < 2; side++) {
        const polygon *one = p->side[side];
        double front = -INFINITY;
        for (int c = 0; c < o->n; c++) {
            double to[3];
            subtract3(o->corner[c], one->centre, to);
            front = fmax(front, dot3(one->normal, to));
        }
        if (front <= p->slack || occluder_in_contact(o, one, p->rise[side], p->slack) ||
            occluder_lies_beside(o, one, p->slack))
            return STANDS_BESIDE;
    }
    const bool apart =
        (low[0] > p->slack && high[1] < -p->slack) || (low[1] > p->slack && high[0] < -p->slack);
    if (apart) {
        const standing found =
            compare_crossings(o, p->side[0], p->side[1], (const double(*)[POLYGON_CORNERS])height, p->slack);
        if (found != STANDS_BETWEEN) return found;
    }
    return is_outside(p, o) ? STANDS_BESIDE : STANDS_BETWEEN;
}

void pair_occluders_find(const occluders *o, const link_occluders *among, const polygon *a, const polygon *b,
                         const uint32_t own_facets[2], const double rise[2], pair_occluders *out) {
    pair_sides p = {.side = {a, b}, .rise = {rise[0], rise[1]}, .slack = o->slack, .has_supports = false};
    out->count = 0;
    out->hidden = false;
    if (among->count == OCCLUDERS_UNCOUNTED) {
        out->count = OCCLUDERS_UNCOUNTED;
        return;
    }
    const capsule within = capsule_of(&p);
    bool too_many = false;
    for (int k = 0; k < among->count; k++) {
        const occluder *one = &o->of[among->of[k]];
        if (capsule_misses(&within, one) || one->facet == own_facets[0] || one->facet == own_facets[1])
            continue;
        const standing found = where_it_stands(&p, one);
        if (found == STANDS_BEFORE_ALL) {
            out->hidden = true;
            out->of[0] = among->of[k];
            out->count = 1;
            return;
        }
        if (found == STANDS_BESIDE) continue;
        if (out->count == LISTED_OCCLUDERS_MOST)
            too_many = true;
        else
            out->of[out->count++] = among->of[k];
    }
    if (too_many) out->count = OCCLUDERS_UNCOUNTED;
}

unsigned pair_occluders_of_part(const occluders *o, const pair_occluders *among, unsigned bits,
                                const polygon *part, const polygon *b, bool *hidden) {
    pair_sides p = {.side = {part, b}, .slack = o->slack, .has_supports = false};
    unsigned left = 0;
    *hidden = false;
    for (int k = 0; k < among->count; k++) {
        if ((bits >> k & 1) == 0) continue;
        const standing found = where_it_stands(&p, &o->of[among->of[k]]);
        if (found == STANDS_BESIDE) continue;
        left |= 1u << k;
        if (found != STANDS_BEFORE_ALL) continue;
        *hidden = true;
        return 1u << k;
    }
    return left;
}
