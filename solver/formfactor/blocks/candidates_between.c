/* The occluders between two rectangles. The segments between them meet the plane of a piece in the section of
 * the convex hull of both with it, the hull of the points where segments from a corner p at height h_p > 0
 * above the plane to a corner q at -h_q < 0 cross it. Of an affine function g, whose values at the corners
 * are g_p and g_q, the value at such a point has the sign of g_p / h_p + g_q / h_q, so that its bounds over
 * all of these are the sums of the bounds over p and over q. */
#include "solver/formfactor/blocks/candidates.h"

#include <math.h>

typedef struct between {
    const flat_pair *at;
    const flat_plane *plane[2];
    const flat_cluster *of[2];
    double low[3], high[3], slack, flush;
    double rise; /* the elements are off their rectangles by this at most */
} between;

/* True where the piece reaches in front of some element of both clusters; amid is set where it does not of
 * all. An element's own piece never does. */
static bool is_in_front(const between *w, const occluder *o, bool amid[2]) {
    for (int side = 0; side < 2; side++) {
        const double *n = w->plane[side]->normal;
        double top = -INFINITY;
        for (int c = 0; c < o->n; c++)
            top = fmax(top, n[0] * o->corner[c][0] + n[1] * o->corner[c][1] + n[2] * o->corner[c][2]);
        if (top <= w->of[side]->lowest_top + w->flush) return false;
        amid[side] = top <= w->of[side]->level + w->of[side]->rise + w->flush;
    }
    return true;
}

static void take_heights(const flat_pair *at, const double plane[4], double out[FLAT_CORNERS]) {
#pragma omp simd
    for (int k = 0; k < FLAT_CORNERS; k++)
        out[k] = plane[0] * at->x[0][k] + plane[1] * at->x[1][k] + plane[2] * at->x[2][k] + plane[3];
}

typedef enum blocking { BLOCKS_NOTHING, BLOCKS_SOME, BLOCKS_ALL } blocking;

static blocking what_blocks(const between *w, const occluder *o, bool amid[2]) {
    enum { FIRST = FLAT_CORNERS / 2 };
    const double slack = w->slack, rise = w->rise, margin = slack - rise,
                 own[4] = {o->normal[0], o->normal[1], o->normal[2], -o->level};
    double height[FLAT_CORNERS], above[FLAT_CORNERS], below[FLAT_CORNERS];
    double low = INFINITY, high = -INFINITY, first_low = INFINITY, first_high = -INFINITY;
    take_heights(w->at, own, height);
    for (int k = 0; k < FLAT_CORNERS; k++) {
        low = height[k] < low ? height[k] : low;
        high = height[k] > high ? height[k] : high;
        if (k != FIRST - 1) continue;
        first_low = low;
        first_high = high;
    }
    if (low >= -margin || high <= margin) return BLOCKS_NOTHING;
    double second_low = INFINITY, second_high = -INFINITY;
    for (int k = FIRST; k < FLAT_CORNERS; k++) {
        second_low = height[k] < second_low ? height[k] : second_low;
        second_high = height[k] > second_high ? height[k] : second_high;
    }
    /* 1 / h of the corners on either side, 0 on the other one. A corner that may lie in the plane counts for
     * both sides, with the least height. */
#pragma omp simd
    for (int k = 0; k < FLAT_CORNERS; k++) {
        const double size = fabs(height[k]), over = 1 / (size > slack ? size : slack);
        above[k] = height[k] >= -slack - rise ? over : 0;
        below[k] = height[k] <= slack + rise ? over : 0;
    }
    bool all = (first_low >= slack && second_high <= -slack) || (first_high <= -slack && second_low >= slack);
    all = all && rise <= w->flush;
    for (int e = 0; e < o->n; e++) {
        double g[FLAT_CORNERS], most_above = -INFINITY, most_below = -INFINITY, least_above = INFINITY,
                                least_below = INFINITY;
        take_heights(w->at, o->edge[e], g);
        for (int k = 0; k < FLAT_CORNERS; k++) {
            const double up = (g[k] - margin) * above[k], down = (g[k] - margin) * below[k];
            if (above[k] > 0) most_above = up > most_above ? up : most_above;
            if (below[k] > 0) most_below = down > most_below ? down : most_below;
        }
        if (most_above + most_below <= 0) return BLOCKS_NOTHING;
        if (!all) continue;
        for (int k = 0; k < FLAT_CORNERS; k++) {
            const double up = g[k] * above[k], down = g[k] * below[k];
            if (above[k] > 0) least_above = up < least_above ? up : least_above;
            if (below[k] > 0) least_below = down < least_below ? down : least_below;
        }
        all = least_above + least_below >= 0;
    }
    if (!is_in_front(w, o, amid)) return BLOCKS_NOTHING;
    return all ? BLOCKS_ALL : BLOCKS_SOME;
}

/* Adds a piece to the candidates; false where there are too many, or no other one is needed. */
static bool try_one(const occluders *o, const between *w, uint32_t k, candidates *out) {
    const occluder *piece = &o->of[k];
    out->examined++;
    for (int d = 0; d < 3; d++)
        if (piece->low[d] > w->high[d] || piece->high[d] < w->low[d]) return true;
    bool amid[2] = {false, false};
    const blocking found = what_blocks(w, piece, amid);
    if (found == BLOCKS_NOTHING) return true;
    for (int side = 0; side < 2; side++) out->amid[side] = out->amid[side] || amid[side];
    if (found == BLOCKS_ALL) {
        out->hidden = true;
        out->of[0] = k;
        out->count = 1;
        return false;
    }
    if (out->count == CANDIDATES_MOST) {
        out->count = CANDIDATES_UNKNOWN;
        return false;
    }
    out->of[out->count++] = k;
    return true;
}

/* The hull of the boxes of both, in front of both. A tree is searched for what reaches into it. */
static void take_shaft(const between *w, shaft *s) {
    enum { CORNERS = FLAT_CORNERS / 2 };
    shaft_box box[2];
    for (int side = 0; side < 2; side++)
        for (int d = 0; d < 3; d++) {
            const double *x = w->at->x[d] + CORNERS * side;
            double low = x[0], high = x[0];
            for (int k = 1; k < CORNERS; k++) {
                low = x[k] < low ? x[k] : low;
                high = x[k] > high ? x[k] : high;
            }
            box[side].low[d] = low - w->rise - w->slack;
            box[side].high[d] = high + w->rise + w->slack;
        }
    shaft_of_boxes(s, &box[0], &box[1], 0);
    for (int side = 0; side < 2; side++)
        shaft_cut(s, w->plane[side]->normal, w->of[side]->lowest_top + w->flush);
}

static void try_all(const occluders *o, const between *w, candidates *out) {
    shaft s;
    const uint32_t *found;
    uint32_t count;
    take_shaft(w, &s);
    for (occluder_search search = occluder_search_begin(o, &s);
         occluder_search_next(&search, &found, &count);)
        for (uint32_t k = 0; k < count; k++)
            if (!try_one(o, w, found[k], out)) return;
}

void candidates_between(const occluders *o, const flat_clusters *f, uint32_t a, uint32_t b,
                        const flat_pair *at, const candidates *among, candidates *out) {
    between w = {.at = at,
                 .plane = {&f->planes[f->of[a].plane], &f->planes[f->of[b].plane]},
                 .of = {&f->of[a], &f->of[b]},
                 .slack = f->slack,
                 .flush = f->flush,
                 .rise = fmax(f->of[a].rise, f->of[b].rise)};
    out->count = out->examined = 0;
    out->hidden = out->amid[0] = out->amid[1] = false;
    if (o->n == 0) return;
    for (int d = 0; d < 3; d++) {
        w.low[d] = w.high[d] = at->x[d][0];
        for (int k = 1; k < FLAT_CORNERS; k++) {
            w.low[d] = at->x[d][k] < w.low[d] ? at->x[d][k] : w.low[d];
            w.high[d] = at->x[d][k] > w.high[d] ? at->x[d][k] : w.high[d];
        }
        w.low[d] -= w.rise;
        w.high[d] += w.rise;
    }
    if (among == NULL || among->count == CANDIDATES_UNKNOWN) {
        try_all(o, &w, out);
        return;
    }
    for (int k = 0; k < among->count; k++)
        if (!try_one(o, &w, among->of[k], out)) return;
}
