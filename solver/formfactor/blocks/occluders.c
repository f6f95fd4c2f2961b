#include "solver/formfactor/blocks/occluders.h"

#include "solver/base/vector3.h"
#include "solver/formfactor/blocks/occluder_join.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Occluders of a box at most. */
enum { BOX_MOST = 2 };

void occluders_free(occluders *o) {
    free(o->of);
    free(o->list);
    free(o->boxes);
    *o = (occluders){.n = 0};
}

static double scale_to_unit(double *x) {
    const double length = sqrt(dot3(x, x));
    for (int d = 0; d < 3; d++) x[d] /= length;
    return length;
}

static void set_occluder(const mesh *m, const uint32_t vertices[4], occluder *o) {
    double one[3], two[3];
    *o = (occluder){.n_corners = (uint32_t)corner_count(vertices)};
    for (uint32_t c = 0; c < o->n_corners; c++)
        memcpy(o->corner[c], m->vertices[vertices[c]], sizeof o->corner[c]);
    subtract3(o->corner[1], o->corner[0], one);
    subtract3(o->corner[2], o->corner[0], two);
    cross3(one, two, o->normal);
    scale_to_unit(o->normal);
    o->level = dot3(o->normal, o->corner[0]);
    for (int d = 0; d < 3; d++) {
        o->low[d] = o->high[d] = o->corner[0][d];
        for (uint32_t c = 1; c < o->n_corners; c++) {
            o->low[d] = fmin(o->low[d], o->corner[c][d]);
            o->high[d] = fmax(o->high[d], o->corner[c][d]);
        }
    }
    for (uint32_t c = 0; c < 4; c++) {
        const uint32_t from = c < o->n_corners ? c : o->n_corners - 1, to = (from + 1) % o->n_corners;
        double along[3], inward[3];
        subtract3(o->corner[to], o->corner[from], along);
        cross3(o->normal, along, inward);
        scale_to_unit(inward);
        memcpy(o->edge[c], inward, sizeof inward);
        o->edge[c][3] = -dot3(inward, o->corner[from]);
    }
}

static double middle_of(const occluder *o, int axis) {
    double sum = 0;
    for (uint32_t c = 0; c < o->n_corners; c++) sum += o->corner[c][axis];
    return sum / o->n_corners;
}

/* The boxes of list[first] ... list[first + count - 1], halved where their middles spread most. */
typedef struct box_key {
    double value;
    uint32_t occluder;
} box_key;

static int by_value(const void *left, const void *right) {
    const box_key *a = left, *b = right;
    if (a->value != b->value) return a->value < b->value ? -1 : 1;
    return a->occluder < b->occluder ? -1 : a->occluder > b->occluder;
}

static void make_box(occluders *o, box_key *keys, size_t at, uint32_t first, uint32_t count) {
    occluder_box box = {.first = first, .count = count};
    double low[3], high[3];
    for (int d = 0; d < 3; d++) box.low[d] = low[d] = INFINITY, box.high[d] = high[d] = -INFINITY;
    for (uint32_t k = first; k < first + count; k++) {
        const occluder *piece = &o->of[o->list[k]];
        for (int d = 0; d < 3; d++) {
            const double middle = middle_of(piece, d);
            low[d] = fmin(low[d], middle);
            high[d] = fmax(high[d], middle);
            for (uint32_t c = 0; c < piece->n_corners; c++) {
                box.low[d] = fmin(box.low[d], piece->corner[c][d]);
                box.high[d] = fmax(box.high[d], piece->corner[c][d]);
            }
        }
    }
    if (count > BOX_MOST) {
        int axis = 0;
        for (int d = 1; d < 3; d++)
            if (high[d] - low[d] > high[axis] - low[axis]) axis = d;
        for (uint32_t k = first; k < first + count; k++)
            keys[k] = (box_key){middle_of(&o->of[o->list[k]], axis), o->list[k]};
        qsort(keys + first, count, sizeof *keys, by_value);
        for (uint32_t k = first; k < first + count; k++) o->list[k] = keys[k].occluder;
        const size_t child = o->n_boxes;
        o->n_boxes += 2;
        make_box(o, keys, child, first, count / 2);
        make_box(o, keys, child + 1, first + count / 2, count - count / 2);
        box.first = (uint32_t)child;
        box.count = 0;
    }
    o->boxes[at] = box;
}

lam_status occluders_make(const mesh *m, const facets *f, double slack, occluders *out, lam_error *error) {
    lam_status status = LAM_OK;
    occluders o = {.n = f->n_pieces};
    box_key *keys = NULL;
    uint32_t(*pieces)[4] = memory_allocate(o.n, sizeof *pieces, "occluders", error);
    if (pieces == NULL) TRY(LAM_ERR_MEMORY);
    memcpy(pieces, f->pieces, o.n * sizeof *pieces);
    TRY(occluders_join(m, slack, pieces, &o.n, error));
    keys = memory_allocate(o.n, sizeof *keys, "occluders", error);
    o.of = memory_allocate(o.n, sizeof *o.of, "occluders", error);
    o.list = memory_allocate(o.n, sizeof *o.list, "occluders", error);
    o.boxes = memory_allocate(2 * o.n + 1, sizeof *o.boxes, "occluders", error);
    if (keys == NULL || o.of == NULL || o.list == NULL || o.boxes == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < o.n; k++) {
        set_occluder(m, pieces[k], &o.of[k]);
        o.list[k] = (uint32_t)k;
    }
    o.n_boxes = 1;
    make_box(&o, keys, 0, 0, (uint32_t)o.n);
    *out = o;
    o = (occluders){.n = 0};
done:
    free(pieces);
    free(keys);
    occluders_free(&o);
    return status;
}

double occluders_place(const occluders *o, const flat_clusters *f, uint32_t a, uint32_t b,
                       const candidates *among) {
    if (among->count <= 0) return .5;
    const occluder *first = &o->of[among->of[0]];
    const double from = dot3(first->normal, f->of[a].centre) - first->level;
    const double to = dot3(first->normal, f->of[b].centre) - first->level;
    return from * to < 0 ? fmin(fmax(from / (from - to), .05), .95) : .5;
}

void occluders_block(const occluders *o, const candidates *among, const double origin[3],
                     const segment_lanes *s, float blocked[SEGMENT_LANES]) {
    memset(blocked, 0, SEGMENT_LANES * sizeof *blocked);
    for (int c = 0; c < among->count; c++) {
        const occluder *piece = &o->of[among->of[c]];
        const float n0 = (float)piece->normal[0], n1 = (float)piece->normal[1], n2 = (float)piece->normal[2];
        const float level = (float)(piece->level - dot3(piece->normal, origin));
        float edge[4][4];
        for (int e = 0; e < 4; e++) {
            for (int d = 0; d < 3; d++) edge[e][d] = (float)piece->edge[e][d];
            edge[e][3] = (float)(piece->edge[e][3] + dot3(piece->edge[e], origin));
        }
#pragma omp simd
        for (int k = 0; k < SEGMENT_LANES; k++) {
            const float x0 = s->from[0][k], x1 = s->from[1][k], x2 = s->from[2][k];
            const float r0 = s->to[0][k] - x0, r1 = s->to[1][k] - x1, r2 = s->to[2][k] - x2;
            const float from = n0 * x0 + n1 * x1 + n2 * x2 - level;
            const float to = from + n0 * r0 + n1 * r1 + n2 * r2;
            const float t = from / (from - to), p0 = x0 + t * r0, p1 = x1 + t * r1, p2 = x2 + t * r2;
            const float e0 = edge[0][0] * p0 + edge[0][1] * p1 + edge[0][2] * p2 + edge[0][3];
            const float e1 = edge[1][0] * p0 + edge[1][1] * p1 + edge[1][2] * p2 + edge[1][3];
            const float e2 = edge[2][0] * p0 + edge[2][1] * p1 + edge[2][2] * p2 + edge[2][3];
            const float e3 = edge[3][0] * p0 + edge[3][1] * p1 + edge[3][2] * p2 + edge[3][3];
            const float low_a = e0 < e1 ? e0 : e1, low_b = e2 < e3 ? e2 : e3;
            const float low = low_a < low_b ? low_a : low_b;
            blocked[k] = ((from * to < 0) & (low > 0)) ? 1.f : blocked[k];
        }
    }
}
