#include "solver/formfactor/sight/windows.h"

#include "solver/base/vector3.h"
#include "solver/formfactor/sight/pair_occluders.h"

#include <math.h>
#include <string.h>

/* WINDOWS_MOST: planes with a window; PIECES_MOST: open pieces of one, with more it is taken as all open. */
enum { WINDOWS_MOST = 4, PIECES_MOST = 64 };

/* Keeps what of p lies where normal . x >= level. Where that has too many corners p stays as it is: what is
 * cut away is proven, what is left is not. n = 0: nothing is left. */
static void keep_above(polygon *p, const double normal[3], double level) {
    polygon left = *p;
    double height[POLYGON_CORNERS];
    left.n = 0;
    for (int c = 0; c < p->n; c++) height[c] = dot3(normal, p->corner[c]) - level;
    for (int c = 0; c < p->n; c++) {
        const int next = (c + 1) % p->n;
        if (height[c] >= 0) {
            if (left.n == POLYGON_CORNERS) return;
            memcpy(left.corner[left.n++], p->corner[c], sizeof left.corner[0]);
        }
        if ((height[c] > 0 && height[next] < 0) || (height[c] < 0 && height[next] > 0)) {
            if (left.n == POLYGON_CORNERS) return;
            const double t = height[c] / (height[c] - height[next]);
            for (int d = 0; d < 3; d++)
                left.corner[left.n][d] = p->corner[c][d] + t * (p->corner[next][d] - p->corner[c][d]);
            left.n++;
        }
    }
    if (left.n < 3) left.n = 0;
    *p = left;
}

/* A plane and the occluders in it. */
typedef struct wall {
    const occluders *o;
    const occluder *in[LINK_OCCLUDERS_MOST];
    int count;
    double axis[2][3];      /* unit, in the plane */
    double low[2], high[2]; /* along the axes: of the box about all open pieces */
    int pieces;
} wall;

static void widen(wall *w, const double at[3]) {
    for (int d = 0; d < 2; d++) {
        const double place = dot3(w->axis[d], at);
        w->low[d] = fmin(w->low[d], place);
        w->high[d] = fmax(w->high[d], place);
    }
}

/* Widens the wall's box by what the occluders from `first` on leave of a piece. Occluders count as wider by
 * the slack, so that none of the cracks between them that rounding makes is a window. */
static void open_pieces(wall *w, const polygon *piece, int first) {
    polygon rest = *piece;
    if (w->pieces > PIECES_MOST) return;
    for (int k = first; k < w->count; k++) {
        const occluder *o = w->in[k];
        polygon inside = rest;
        for (int e = 0; e < o->n && inside.n > 0; e++)
            keep_above(&inside, o->edge[e], -o->edge[e][3] - w->o->slack);
        if (inside.n == 0) continue;
        inside = rest;
        for (int e = 0; e < o->n && inside.n > 0; e++) {
            const double out[3] = {-o->edge[e][0], -o->edge[e][1], -o->edge[e][2]};
            polygon outside = inside;
            keep_above(&outside, out, o->edge[e][3] + w->o->slack);
            if (outside.n > 0) open_pieces(w, &outside, k + 1);
            keep_above(&inside, o->edge[e], -o->edge[e][3] - w->o->slack);
        }
        return;
    }
    w->pieces++;
    for (int c = 0; c < rest.n; c++) widen(w, rest.corner[c]);
}

static void box_of(const wall *w, polygon *out) {
    const occluder *o = w->in[0];
    *out = (polygon){.n = 4};
    for (int c = 0; c < 4; c++)
        for (int d = 0; d < 3; d++)
            out->corner[c][d] = o->level * o->normal[d] +
                                (c == 1 || c == 2 ? w->high[0] : w->low[0]) * w->axis[0][d] +
                                (c >= 2 ? w->high[1] : w->low[1]) * w->axis[1][d];
}

/* A window, seen from a: a lies where normal . x >= level, b where it is <= level. */
typedef struct window {
    polygon box;
    double normal[3], level;
} window;

/* The box of the points where segments between a and b cross the plane: those between corners hold the others
 * in their hull. False where a and b are not on different sides of the plane. */
static bool crossing_box(wall *w, const polygon *a, const polygon *b, double *side) {
    const occluder *o = w->in[0];
    const polygon *both[2] = {a, b};
    const double slack = w->o->slack;
    double height[2][POLYGON_CORNERS], low[2], high[2];
    for (int s = 0; s < 2; s++) {
        low[s] = INFINITY, high[s] = -INFINITY;
        for (int c = 0; c < both[s]->n; c++) {
            height[s][c] = dot3(o->normal, both[s]->corner[c]) - o->level;
            low[s] = fmin(low[s], height[s][c]);
            high[s] = fmax(high[s], height[s][c]);
        }
    }
    *side = high[0] > high[1] ? 1 : -1;
    if (*side > 0 ? low[0] < -slack || high[1] > slack || high[0] <= slack || low[1] >= -slack
                  : high[0] > slack || low[1] < -slack || low[0] >= -slack || high[1] <= slack)
        return false;
    for (int d = 0; d < 2; d++) w->low[d] = INFINITY, w->high[d] = -INFINITY;
    for (int i = 0; i < a->n; i++)
        for (int j = 0; j < b->n; j++) {
            const double apart[2] = {fabs(height[0][i]), fabs(height[1][j])};
            double at[3];
            if (apart[0] + apart[1] <= slack) continue; /* the segment lies in the plane */
            const double t = apart[0] / (apart[0] + apart[1]);
            for (int d = 0; d < 3; d++) at[d] = a->corner[i][d] + t * (b->corner[j][d] - a->corner[i][d]);
            widen(w, at);
        }
    return w->low[0] <= w->high[0];
}

/* The axes of a wall, along the first side of its first occluder. */
static void set_axes(wall *w) {
    const occluder *o = w->in[0];
    memcpy(w->axis[0], o->edge[0], sizeof w->axis[0]);
    cross3(o->normal, w->axis[0], w->axis[1]);
}

/* Finds the window of a wall. */
static windows_found find_window(wall *w, const polygon *a, const polygon *b, window *out) {
    polygon all;
    double side;
    set_axes(w);
    if (!crossing_box(w, a, b, &side)) return WINDOWS_NONE;
    box_of(w, &all);
    const double before = (w->high[0] - w->low[0]) * (w->high[1] - w->low[1]);
    for (int d = 0; d < 2; d++) w->low[d] = INFINITY, w->high[d] = -INFINITY;
    w->pieces = 0;
    open_pieces(w, &all, 0);
    if (w->pieces > PIECES_MOST) return WINDOWS_NONE;
    if (w->pieces == 0) return WINDOWS_CLOSED;
    if (!((w->high[0] - w->low[0]) * (w->high[1] - w->low[1]) < .9 * before)) return WINDOWS_NONE;
    box_of(w, &out->box);
    for (int d = 0; d < 3; d++) out->normal[d] = side * w->in[0]->normal[d];
    out->level = side * w->in[0]->level;
    return WINDOWS_CUT;
}

/* Light from `far` through `near` meets p only on near's side of each plane that separates the two: the
 * planes through an edge of one and a corner of the other with one on each side. */
static void cut_by_edges(polygon *p, const polygon *near, const polygon *far, double slack) {
    const polygon *both[2] = {near, far};
    for (int s = 0; s < 2; s++)
        for (int e = 0; e < both[s]->n; e++) {
            const polygon *with = both[s], *other = both[1 - s];
            const double *from = with->corner[e];
            double along[3];
            subtract3(with->corner[(e + 1) % with->n], from, along);
            for (int c = 0; c < other->n && p->n > 0; c++) {
                double across[3], normal[3], least = INFINITY, most = -INFINITY;
                subtract3(other->corner[c], from, across);
                cross3(along, across, normal);
                const double length = sqrt(dot3(normal, normal));
                if (!(length > slack * slack)) continue;
                for (int d = 0; d < 3; d++) normal[d] /= length;
                const double level = dot3(normal, from);
                double near_low = INFINITY, near_high = -INFINITY;
                for (int k = 0; k < far->n; k++) {
                    const double height = dot3(normal, far->corner[k]) - level;
                    least = fmin(least, height);
                    most = fmax(most, height);
                }
                for (int k = 0; k < near->n; k++) {
                    const double height = dot3(normal, near->corner[k]) - level;
                    near_low = fmin(near_low, height);
                    near_high = fmax(near_high, height);
                }
                if (most <= slack && near_low >= -slack) {
                    keep_above(p, normal, level - slack);
                } else if (least >= -slack && near_high <= slack) {
                    for (int d = 0; d < 3; d++) normal[d] = -normal[d];
                    keep_above(p, normal, -level - slack);
                }
            }
        }
}

/* True where all light from b passes window `far` before window `near`. */
static bool is_before(const window *near, const window *far, double slack) {
    for (int c = 0; c < 4; c++)
        if (dot3(far->normal, near->box.corner[c]) - far->level < -slack ||
            dot3(near->normal, far->box.corner[c]) - near->level > slack)
            return false;
    return true;
}

/* Cuts a by the light from b through windows, and b likewise. */
static void cut_both(polygon *a, polygon *b, const window *of, int n, double slack) {
    for (int k = 0; k < n; k++) cut_by_edges(a, &of[k].box, b, slack);
    for (int k = 0; k < n; k++)
        for (int l = 0; l < n; l++)
            if (k != l && is_before(&of[k], &of[l], slack)) {
                cut_by_edges(a, &of[k].box, &of[l].box, slack);
                cut_by_edges(b, &of[l].box, &of[k].box, slack);
            }
    for (int k = 0; k < n && a->n > 0; k++) cut_by_edges(b, &of[k].box, a, slack);
}

/* Drops corners that cuts put at the same place; false where what is left has no area. */
static bool drop_repeated(polygon *p) {
    polygon kept = *p;
    polygon_set_extent(p);
    kept.n = 0;
    for (int c = 0; c < p->n; c++) {
        double apart[3];
        subtract3(p->corner[c], p->corner[(c + 1) % p->n], apart);
        if (dot3(apart, apart) > 1e-18 * p->radius * p->radius)
            memcpy(kept.corner[kept.n++], p->corner[c], sizeof kept.corner[0]);
    }
    if (kept.n < 3) return false;
    polygon_set_extent(&kept);
    *p = kept;
    return true;
}

windows_found windows_cut(const occluders *o, const link_occluders *among, const uint32_t own_facets[2],
                          const double rise[2], polygon *a, polygon *b) {
    window found[WINDOWS_MOST];
    int n = 0;
    uint64_t done = 0;
    for (int k = 0; k < among->count && n < WINDOWS_MOST; k++) {
        wall w = {.o = o, .count = 0};
        const occluder *first = &o->of[among->of[k]];
        if (done >> k & 1) continue;
        for (int l = k; l < among->count; l++) {
            const occluder *one = &o->of[among->of[l]];
            if (one->facet == own_facets[0] || one->facet == own_facets[1]) continue;
            if (occluder_in_contact(one, a, rise[0], o->slack) ||
                occluder_in_contact(one, b, rise[1], o->slack) || occluder_lies_beside(one, a, o->slack) ||
                occluder_lies_beside(one, b, o->slack))
                continue;
            bool in_plane = true;
            for (int c = 0; c < one->n && in_plane; c++)
                in_plane = fabs(dot3(first->normal, one->corner[c]) - first->level) <= o->slack;
            if (!in_plane) continue;
            done |= (uint64_t)1 << l;
            w.in[w.count++] = one;
        }
        if (w.count < 2 || w.in[0] != first) continue;
        const windows_found state = find_window(&w, a, b, &found[n]);
        if (state == WINDOWS_CLOSED) return WINDOWS_CLOSED;
        n += state == WINDOWS_CUT;
    }
    if (n == 0) return WINDOWS_NONE;
    polygon parts[2] = {*a, *b};
    cut_both(&parts[0], &parts[1], found, n, o->slack);
    if (parts[0].n == 0 || parts[1].n == 0) return WINDOWS_CLOSED;
    if (!drop_repeated(&parts[0]) || !drop_repeated(&parts[1])) return WINDOWS_CLOSED;
    *a = parts[0];
    *b = parts[1];
    return WINDOWS_CUT;
}
