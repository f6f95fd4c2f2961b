/* The occluders between two rectangles. The segments between them meet the plane of a piece in the section of
 * the convex hull of both with it, the hull of the points where segments from a corner p at height h_p > 0
 * above the plane to a corner q at -h_q < 0 cross it. Of an affine function g, whose values at the corners
 * are g_p and g_q, the value at such a point has the sign of g_p / h_p + g_q / h_q, so that its bounds over
 * all of these are the sums of the bounds over p and over q. */
#include "solver/base/cpu.h"
#include "solver/formfactor/blocks/candidates.h"

#include <math.h>

typedef struct between {
    const flat_pair *at;
    const flat_plane *plane[2];
    const flat_cluster *of[2];
    const uint32_t (*set_range)[2];
    double low[3], high[3], slack, flush;
    double rise; /* the elements are off their rectangles by this at most */
} between;

/* True for a piece of the plane in which all elements of a node lie: it hides nothing of them. Its corners
 * may be higher than they are over the plane of the node, in which faces are a little turned against each
 * other: the halves of a quad that is not quite plane. */
static inline bool is_own(const flat_cluster *node, const occluder *o) {
    return o->set == node->set;
}

/* True where some elements of a node may lie in the plane of a piece. */
static inline bool may_hold(const between *w, const flat_cluster *node, const occluder *o) {
    return w->set_range != NULL && node->set == FLAT_MIXED && w->set_range[o->set][0] < node->end &&
           w->set_range[o->set][1] >= node->begin;
}

typedef enum blocking { BLOCKS_NOTHING, BLOCKS_SOME, BLOCKS_ALL } blocking;

#define CPU_KERNELS "solver/formfactor/blocks/candidates_between_kernels.inc"
#include "solver/base/cpu_kernels.inc"

static bool sift(const occluder *of, const between *w, const uint32_t *list, uint32_t count,
                 candidates *out) {
    typedef bool kernel(const occluder *, const between *, const uint32_t *, uint32_t, candidates *);
    static kernel *const table[] = CPU_TABLE(sift_portable, sift_avx2, sift_avx512);
    return table[cpu_best()](of, w, list, count, out);
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

bool candidates_are_others(const occluders *o, const flat_clusters *f, uint32_t a, uint32_t b,
                           const candidates *among) {
    for (int k = 0; k < among->count; k++)
        if (is_own(&f->of[a], &o->of[among->of[k]]) || is_own(&f->of[b], &o->of[among->of[k]])) return false;
    return true;
}

static void try_all(const occluders *o, const between *w, candidates *out) {
    shaft s;
    const uint32_t *found;
    uint32_t count;
    take_shaft(w, &s);
    for (occluder_search search = occluder_search_begin(o, &s);
         occluder_search_next(&search, &found, &count);)
        if (!sift(o->of, w, found, count, out)) return;
}

void candidates_between(const occluders *o, const flat_clusters *f, uint32_t a, uint32_t b,
                        const flat_pair *at, const candidates *among, candidates *out) {
    between w = {.at = at,
                 .plane = {&f->planes[f->of[a].plane], &f->planes[f->of[b].plane]},
                 .of = {&f->of[a], &f->of[b]},
                 .set_range = (const uint32_t(*)[2])f->set_range,
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
    sift(o->of, &w, among->of, (uint32_t)among->count, out);
}
