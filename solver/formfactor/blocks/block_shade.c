#include "solver/formfactor/blocks/block_shade.h"

#include "solver/formfactor/visibility/pane_path.h"
#include "solver/formfactor/visibility/sample.h"

#include <math.h>

/* Both ends of the segments. */
typedef struct segment_ends {
    double from[SEGMENT_LANES][3], to[SEGMENT_LANES][3];
    uint32_t elements[2][SEGMENT_LANES];
} segment_ends;

/* A point of a node by (u, v) in the unit square. Of a full rectangle its element is any of the plane:
 * nothing in the planes of both ends blocks a segment. */
static void take_point(const flat_clusters *f, uint32_t node, const double at[2], double place[2],
                       double point[3], uint32_t *element) {
    if (f->of[node].full) {
        for (int k = 0; k < 2; k++) place[k] = 2 * at[k] - 1;
        *element = f->tree->order[f->tree->nodes[node].begin];
        flat_cluster_point(f, node, place[0], place[1], point);
        return;
    }
    *element = f->tree->order[flat_cluster_sample(f, node, at[0], at[1], place, point)];
}

/* Embree tells which segments are seen. */
static void block_by_scene(const shade_scene *s, const segment_ends *ends, seen_segment *out) {
    const visibility *v = s->v;
    for (size_t first = 0; first < SEGMENT_LANES; first += VISIBILITY_PACKET) {
        ray_packet packet;
        for (size_t k = 0; k < VISIBILITY_PACKET; k++) {
            float from[3], to[3];
            visibility_recentre(v, ends->from[first + k], from);
            visibility_recentre(v, ends->to[first + k], to);
            for (int d = 0; d < 3; d++) {
                packet.origin[d][k] = from[d];
                packet.direction[d][k] = to[d] - from[d];
            }
        }
        const unsigned blocked = visibility_blocked(v, &packet, VISIBILITY_PACKET, &ends->elements[0][first],
                                                    &ends->elements[1][first]);
        double passed[VISIBILITY_PACKET];
        for (size_t k = 0; k < VISIBILITY_PACKET; k++) passed[k] = blocked >> k & 1 ? 0 : 1;
        if (s->glass != NULL)
            pane_path_between(v, s->glass, &packet, VISIBILITY_PACKET, &ends->elements[0][first],
                              &ends->elements[1][first], blocked, passed);
        for (size_t k = 0; k < VISIBILITY_PACKET; k++) {
            out[first + k].seen = passed[k];
            out[first + k].through = blocked >> k & 1 ? passed[k] : 0;
        }
    }
}

/* Segment k crosses a pane. */
static void pass_pane(const shade_scene *s, const occluder *pane, const segment_ends *ends, int k,
                      seen_segment *out) {
    double along = 0, square = 0;
    for (int d = 0; d < 3; d++) {
        const double way = ends->to[k][d] - ends->from[k][d];
        along += way * pane->normal[d];
        square += way * way;
    }
    out->seen *= mesh_pane_passes(s->glass, pane->pane, fabs(along) / sqrt(square));
    out->through = out->seen;
}

static void block_by_candidates(const shade_scene *s, const double origin[3], const candidates *among,
                                const segment_ends *ends, seen_segment *out) {
    segment_lanes lanes;
    float blocked[SEGMENT_LANES];
    for (int k = 0; k < SEGMENT_LANES; k++)
        for (int d = 0; d < 3; d++) {
            lanes.from[d][k] = (float)(ends->from[k][d] - origin[d]);
            lanes.to[d][k] = (float)(ends->to[k][d] - origin[d]);
        }
    if (s->glass == NULL) {
        candidates_block(s->occluders, among, origin, &lanes, blocked);
        for (int k = 0; k < SEGMENT_LANES; k++) out[k].seen = 1 - (double)blocked[k];
        return;
    }
    candidates opaque = {.count = 0}, panes = {.count = 0};
    for (int c = 0; c < among->count; c++) {
        candidates *const to = s->occluders->of[among->of[c]].pane == MESH_NO_VERTEX ? &opaque : &panes;
        to->of[to->count++] = among->of[c];
    }
    candidates_block(s->occluders, &opaque, origin, &lanes, blocked);
    for (int k = 0; k < SEGMENT_LANES; k++) out[k].seen = 1 - (double)blocked[k];
    for (int c = 0; c < panes.count; c++) {
        const candidates one = {.count = 1, .of = {panes.of[c]}};
        candidates_block(s->occluders, &one, origin, &lanes, blocked);
        for (int k = 0; k < SEGMENT_LANES; k++)
            if (blocked[k] > 0) pass_pane(s, &s->occluders->of[panes.of[c]], ends, k, &out[k]);
    }
}

void shade_segments(const shade_scene *s, uint32_t a, uint32_t b, const candidates *among,
                    seen_segment out[SEGMENT_LANES]) {
    const flat_clusters *f = s->f;
    const bool by_scene = among->count == CANDIDATES_UNKNOWN;
    segment_ends ends = {.elements = {{0}}};
    for (int k = 0; k < SEGMENT_LANES; k++) out[k].through = 0;
    pair_sampler sampler;
    pair_sampler_init(&sampler, s->seed, a, b);
    for (size_t begin = 0; begin < SEGMENT_LANES; begin += VISIBILITY_PACKET) {
        double x[4][VISIBILITY_PACKET];
        pair_sampler_packet(&sampler, (uint32_t)begin, x);
        for (size_t p = 0; p < VISIBILITY_PACKET; p++) {
            const size_t k = begin + p;
            const double from[2] = {x[0][p], x[1][p]}, to[2] = {x[2][p], x[3][p]};
            take_point(f, a, from, out[k].place, ends.from[k], &ends.elements[0][k]);
            take_point(f, b, to, out[k].place + 2, ends.to[k], &ends.elements[1][k]);
        }
    }
    if (by_scene)
        block_by_scene(s, &ends, out);
    else
        block_by_candidates(s, f->of[a].centre, among, &ends, out);
}
