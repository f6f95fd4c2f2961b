#include "solver/formfactor/blocks/candidates.h"

#include "solver/base/vector3.h"

#include <math.h>
#include <string.h>

double candidates_place(const occluders *o, const flat_clusters *f, uint32_t a, uint32_t b,
                        const candidates *among) {
    if (among->count <= 0) return .5;
    const occluder *first = &o->of[among->of[0]];
    const double from = dot3(first->normal, f->of[a].centre) - first->level;
    const double to = dot3(first->normal, f->of[b].centre) - first->level;
    return from * to < 0 ? fmin(fmax(from / (from - to), .05), .95) : .5;
}

/* blocked = 1 where a segment crosses the piece, in coordinates about origin. */
static void block_by_one(const occluder *piece, const double origin[3], const segment_lanes *s,
                         float blocked[SEGMENT_LANES]) {
    const float n0 = (float)piece->normal[0], n1 = (float)piece->normal[1], n2 = (float)piece->normal[2];
    const float level = (float)(piece->level - dot3(piece->normal, origin));
    float at[3][SEGMENT_LANES], inside[SEGMENT_LANES];
#pragma omp simd
    for (int k = 0; k < SEGMENT_LANES; k++) {
        const float x0 = s->from[0][k], x1 = s->from[1][k], x2 = s->from[2][k];
        const float r0 = s->to[0][k] - x0, r1 = s->to[1][k] - x1, r2 = s->to[2][k] - x2;
        const float from = n0 * x0 + n1 * x1 + n2 * x2 - level;
        const float to = from + n0 * r0 + n1 * r1 + n2 * r2;
        const float t = from / (from - to);
        at[0][k] = x0 + t * r0, at[1][k] = x1 + t * r1, at[2][k] = x2 + t * r2;
        inside[k] = from * to < 0 ? 1 : -1;
    }
    for (int e = 0; e < piece->n; e++) {
        const double *own = piece->edge[e];
        const float e0 = (float)own[0], e1 = (float)own[1], e2 = (float)own[2];
        const float e3 = (float)(own[3] + dot3(own, origin));
#pragma omp simd
        for (int k = 0; k < SEGMENT_LANES; k++) {
            const float here = e0 * at[0][k] + e1 * at[1][k] + e2 * at[2][k] + e3;
            inside[k] = here < inside[k] ? here : inside[k];
        }
    }
#pragma omp simd
    for (int k = 0; k < SEGMENT_LANES; k++) blocked[k] = inside[k] > 0 ? 1.f : blocked[k];
}

void candidates_block(const occluders *o, const candidates *among, const double origin[3],
                      const segment_lanes *s, float blocked[SEGMENT_LANES]) {
    memset(blocked, 0, SEGMENT_LANES * sizeof *blocked);
    for (int c = 0; c < among->count; c++) block_by_one(&o->of[among->of[c]], origin, s, blocked);
}
