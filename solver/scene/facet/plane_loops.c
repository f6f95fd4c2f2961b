#include "solver/scene/facet/plane_loops.h"

#include "solver/base/array_grow.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Half-edge 2 e runs along edge e, half-edge 2 e + 1 back; here it leaves a point in a direction. */
typedef struct edge_turn {
    double angle;
    uint32_t point;
    size_t half;
} edge_turn;

static uint32_t start_of(const plane_edge *edges, size_t half) {
    return half % 2 == 0 ? edges[half / 2].from : edges[half / 2].to;
}

static side_state left_of(const plane_edge *edges, size_t half) {
    return half % 2 == 0 ? edges[half / 2].left : edges[half / 2].right;
}

static int by_turn(const void *a, const void *b) {
    const edge_turn *p = a, *q = b;
    if (p->point != q->point) return p->point < q->point ? -1 : 1;
    if (p->angle != q->angle) return p->angle < q->angle ? -1 : 1;
    return (p->half > q->half) - (p->half < q->half);
}

static lam_status reserve(plane_loops *l, size_t n_points, size_t n_halves, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(array_grow(&l->loops, &l->loop_capacity, n_halves, sizeof *l->loops, "outlines", error));
    TRY(array_grow(&l->points, &l->point_capacity, n_halves, sizeof *l->points, "outlines", error));
    TRY(array_grow(&l->turns, &l->turn_capacity, n_halves, sizeof *l->turns, "outlines", error));
    TRY(array_grow(&l->first, &l->first_capacity, n_points + 1, sizeof *l->first, "outlines", error));
    TRY(array_grow(&l->place, &l->place_capacity, n_halves, sizeof *l->place, "outlines", error));
    TRY(array_grow(&l->walked, &l->walked_capacity, n_halves, sizeof *l->walked, "outlines", error));
done:
    return status;
}

/* The half-edge that follows: from its end, the first one clockwise of the way back. */
static size_t next_of(const plane_loops *l, const plane_edge *edges, size_t half) {
    const size_t back = half ^ 1, at = l->place[back], first = l->first[start_of(edges, back)];
    return l->turns[at > first ? at - 1 : l->first[start_of(edges, back) + 1] - 1].half;
}

static void walk(plane_loops *l, const double (*points)[2], const plane_edge *edges, size_t start) {
    plane_loop made = {.first = l->n_points};
    const double *origin = points[start_of(edges, start)];
    for (size_t half = start; !l->walked[half]; half = next_of(l, edges, half)) {
        const side_state left = left_of(edges, half);
        const double *p = points[start_of(edges, half)], *q = points[start_of(edges, half ^ 1)];
        made.area += .5 * ((p[0] - origin[0]) * (q[1] - origin[1]) - (p[1] - origin[1]) * (q[0] - origin[0]));
        made.empty = made.empty || left == SIDE_EMPTY;
        made.filled = made.filled || left == SIDE_FILLED;
        made.unknown = made.unknown || left == SIDE_UNKNOWN;
        l->points[l->n_points++] = start_of(edges, half);
        l->walked[half] = true;
    }
    made.count = l->n_points - made.first;
    l->loops[l->n++] = made;
}

lam_status plane_loops_trace(size_t n_points, const double (*points)[2], size_t n_edges,
                             const plane_edge *edges, plane_loops *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t halves = 2 * n_edges;
    TRY(reserve(out, n_points, halves, error));
    for (size_t h = 0; h < halves; h++) {
        const double *p = points[start_of(edges, h)], *q = points[start_of(edges, h ^ 1)];
        out->turns[h] = (edge_turn){atan2(q[1] - p[1], q[0] - p[0]), start_of(edges, h), h};
        out->walked[h] = false;
    }
    qsort(out->turns, halves, sizeof *out->turns, by_turn);
    for (size_t p = 0, k = 0; p <= n_points; p++) {
        while (k < halves && out->turns[k].point < p) k++;
        out->first[p] = k;
    }
    for (size_t k = 0; k < halves; k++) out->place[out->turns[k].half] = k;
    out->n = out->n_points = 0;
    for (size_t h = 0; h < halves; h++)
        if (!out->walked[h]) walk(out, points, edges, h);
done:
    return status;
}

void plane_loops_free(plane_loops *l) {
    free(l->loops);
    free(l->points);
    free(l->turns);
    free(l->first);
    free(l->place);
    free(l->walked);
    *l = (plane_loops){.n = 0};
}
