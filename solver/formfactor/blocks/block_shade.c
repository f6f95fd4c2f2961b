#include "solver/formfactor/blocks/block_shade.h"

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

/* Bits of the segments that Embree finds blocked. */
static void block_by_scene(const visibility *v, const segment_ends *ends, seen_segment *out) {
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
        for (size_t k = 0; k < VISIBILITY_PACKET; k++) out[first + k].seen = (blocked >> k & 1) ? 0 : 1;
    }
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
    candidates_block(s->occluders, among, origin, &lanes, blocked);
    for (int k = 0; k < SEGMENT_LANES; k++) out[k].seen = 1 - (double)blocked[k];
}

void shade_segments(const shade_scene *s, uint32_t a, uint32_t b, const candidates *among,
                    seen_segment out[SEGMENT_LANES]) {
    const flat_clusters *f = s->f;
    const bool by_scene = among->count == CANDIDATES_UNKNOWN;
    segment_ends ends = {.elements = {{0}}};
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
        block_by_scene(s->v, &ends, out);
    else
        block_by_candidates(s, f->of[a].centre, among, &ends, out);
}
