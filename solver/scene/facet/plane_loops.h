/* The regions of a plane between straight edges, each by the loop around it. Knows no faces. */
#ifndef LAMBERT_SCENE_FACET_PLANE_LOOPS_H
#define LAMBERT_SCENE_FACET_PLANE_LOOPS_H

#include "store/status.h"

#include <stdbool.h>
#include <stdint.h>

/* A side of an edge: a face covers it, none does, or the edge belongs to no face of the plane. */
typedef enum side_state { SIDE_UNKNOWN, SIDE_EMPTY, SIDE_FILLED } side_state;

typedef struct plane_edge {
    uint32_t from, to; /* points */
    side_state left, right;
} plane_edge;

/* A closed walk around a region, which lies on its left: counter-clockwise around a bounded one, whose area
 * is positive, clockwise around what lies outside of it. */
typedef struct plane_loop {
    size_t first, count; /* in points */
    double area;
    bool empty, filled, unknown; /* some of its edges have this side */
} plane_loop;

/* Freed by plane_loops_free; its arrays are used again by the next trace. */
typedef struct plane_loops {
    size_t n, n_points;
    plane_loop *loops;
    uint32_t *points; /* [n_points], of the loops, one after the other */
    size_t loop_capacity, point_capacity, turn_capacity, first_capacity, place_capacity, walked_capacity;
    struct edge_turn *turns; /* scratch from here on */
    size_t *first, *place;
    bool *walked;
} plane_loops;

/* The loops of n_edges edges between n_points points; the edges must not cross. At a point where several
 * edges meet the walk takes the next one clockwise, so that regions that touch there stay apart. An edge that
 * ends freely is walked along both sides. Cost: O(n log n). Errors: LAM_ERR_MEMORY. */
lam_status plane_loops_trace(size_t n_points, const double (*points)[2], size_t n_edges,
                             const plane_edge *edges, plane_loops *out, lam_error *error);
void plane_loops_free(plane_loops *l);

#endif
