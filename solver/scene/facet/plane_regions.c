/* The edges in a plane are gathered, each side of them is marked as covered, empty or unknown, and loops are
 * traced around empty sides: one of positive area, sum of (p x q) / 2, is an open region, and one of negative
 * area outlines what is covered, whose pockets within the convex hull are open as well. */
#include "solver/scene/facet/plane_regions.h"

#include "solver/base/array_grow.h"
#include "solver/base/array_sort.h"
#include "solver/base/union_find.h"
#include "solver/base/vector3.h"
#include "solver/scene/facet/plane_loops.h"
#include "solver/scene/facet/plane_outside.h"
#include "solver/scene/facet/plane_rectangle.h"
#include "solver/scene/plane.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A plane by a point and its axes; axis[2] is the normal. */
typedef struct plane_frame {
    double origin[3], axis[3][3];
} plane_frame;

typedef struct explorer {
    const mesh *m;
    const face_edges *e;
    size_t n_faces;
    double slack, narrow;
    plane_regions *out;
    plane_frame plane;
    uint32_t n_planes;
    bool *done;            /* [n_faces]: lies in a plane that was looked at */
    uint32_t *edge_stamp;  /* [edges], the last plane that an edge lies in */
    uint32_t *place_stamp; /* [places] */
    uint32_t *local;       /* [places], the number of a place in the present plane */
    /* the present plane: */
    uint32_t *places, *edges;
    double (*points)[2];
    plane_edge *rims;
    size_t n_places, n_edges, n_rims;
    size_t place_capacity, edge_capacity, point_capacity, rim_capacity;
    plane_loops loops;
    plane_outside outside;
} explorer;

static void flatten(const plane_frame *p, const double x[3], double at[3]) {
    const double r[3] = {x[0] - p->origin[0], x[1] - p->origin[1], x[2] - p->origin[2]};
    for (int k = 0; k < 3; k++) at[k] = dot3(r, p->axis[k]);
}

/* The plane of a face; false where it has hardly an area. */
static bool frame_of_face(const mesh *m, uint32_t face, plane_frame *out) {
    const size_t corners = mesh_corners(m, face);
    double length;
    memcpy(out->origin, m->vertices[m->elements[face][0]], sizeof out->origin);
    double *n = out->axis[2];
    n[0] = n[1] = n[2] = 0;
    for (size_t k = 1; k + 1 < corners; k++) {
        const double *a = m->vertices[m->elements[face][k]], *b = m->vertices[m->elements[face][k + 1]];
        double u[3], w[3], product[3];
        subtract3(a, out->origin, u);
        subtract3(b, out->origin, w);
        cross3(u, w, product);
        for (int d = 0; d < 3; d++) n[d] += product[d];
    }
    length = sqrt(dot3(n, n));
    if (!(length > 0)) return false;
    for (int d = 0; d < 3; d++) n[d] /= length;
    plane_axes(n, out->axis[0], out->axis[1]);
    return true;
}

static bool lies_in(const explorer *x, uint32_t place) {
    double at[3];
    flatten(&x->plane, x->m->vertices[place], at);
    return fabs(at[2]) <= x->slack;
}

static lam_status add_place(explorer *x, uint32_t place, lam_error *error) {
    lam_status status = LAM_OK;
    double at[3];
    if (x->place_stamp[place] == x->n_planes) return LAM_OK;
    TRY(array_grow(&x->places, &x->place_capacity, x->n_places + 1, sizeof *x->places, "outlines", error));
    TRY(array_grow(&x->points, &x->point_capacity, x->n_places + 1, sizeof *x->points, "outlines", error));
    flatten(&x->plane, x->m->vertices[place], at);
    memcpy(x->points[x->n_places], at, sizeof *x->points);
    x->place_stamp[place] = x->n_planes;
    x->local[place] = (uint32_t)x->n_places;
    x->places[x->n_places++] = place;
done:
    return status;
}

static lam_status add_edge(explorer *x, uint32_t edge, lam_error *error) {
    lam_status status = LAM_OK;
    x->edge_stamp[edge] = x->n_planes;
    TRY(array_grow(&x->edges, &x->edge_capacity, x->n_edges + 1, sizeof *x->edges, "outlines", error));
    x->edges[x->n_edges++] = edge;
    TRY(add_place(x, x->e->ends[edge][0], error));
    TRY(add_place(x, x->e->ends[edge][1], error));
done:
    return status;
}

static void begin_plane(explorer *x) {
    x->n_planes++;
    x->n_places = x->n_edges = x->n_rims = 0;
}

/* All edges in the plane that are connected to a face in it. */
static lam_status explore(explorer *x, uint32_t face, lam_error *error) {
    lam_status status = LAM_OK;
    for (size_t k = 0; k < mesh_corners(x->m, face); k++)
        TRY(add_place(x, x->e->place[x->m->elements[face][k]], error));
    for (size_t next = 0; next < x->n_places; next++) {
        const uint32_t place = x->places[next];
        for (size_t k = x->e->first_at[place]; k < x->e->first_at[place + 1]; k++) {
            const uint32_t edge = x->e->at[k];
            const uint32_t *ends = x->e->ends[edge];
            if (x->edge_stamp[edge] == x->n_planes || !lies_in(x, ends[ends[0] == place])) continue;
            TRY(add_edge(x, edge, error));
        }
    }
done:
    return status;
}

/* 1 where a face in the plane has its front on the side of the normal, -1 where its back, 0 where it lies in
 * another plane or has hardly an area. */
static int turn_in_plane(const explorer *x, uint32_t face) {
    const size_t corners = mesh_corners(x->m, face);
    double at[4][3], doubled = 0, round = 0;
    for (size_t k = 0; k < corners; k++) {
        const uint32_t place = x->e->place[x->m->elements[face][k]];
        flatten(&x->plane, x->m->vertices[place], at[k]);
        if (fabs(at[k][2]) > x->slack) return 0;
    }
    for (size_t k = 0; k < corners; k++) {
        const double *p = at[k], *q = at[(k + 1) % corners];
        doubled += p[0] * q[1] - p[1] * q[0];
        round += plane_distance(p, q);
    }
    if (!(fabs(doubled) > x->slack * round)) return 0;
    return doubled > 0 ? 1 : -1;
}

/* The edges of the plane with what lies on their sides, without those that faces cover on both. */
static lam_status find_rims(explorer *x, bool *alone, lam_error *error) {
    lam_status status = LAM_OK;
    *alone = true;
    for (size_t k = 0; k < x->n_edges; k++) {
        const uint32_t edge = x->edges[k];
        bool left = false, right = false;
        for (size_t s = x->e->first[edge]; s < x->e->first[edge + 1]; s++) {
            const edge_face *of = &x->e->faces[s];
            const int turn = turn_in_plane(x, of->face);
            if (turn == 0) continue;
            x->done[of->face] = true;
            if ((turn > 0) == of->forward)
                left = true;
            else
                right = true;
        }
        if (left && right) *alone = false;
        if (!left && !right) *alone = false;
        if (left && right) continue;
        TRY(array_grow(&x->rims, &x->rim_capacity, x->n_rims + 1, sizeof *x->rims, "outlines", error));
        const side_state other = left || right ? SIDE_EMPTY : SIDE_UNKNOWN;
        x->rims[x->n_rims++] = (plane_edge){x->local[x->e->ends[edge][0]], x->local[x->e->ends[edge][1]],
                                            left ? SIDE_FILLED : other, right ? SIDE_FILLED : other};
    }
done:
    return status;
}

/* Adds the region inside a ring of points of the plane, turned where it runs clockwise. */
static lam_status add_region(explorer *x, size_t count, const uint32_t *points, bool open, lam_error *error) {
    lam_status status = LAM_OK;
    plane_regions *r = x->out;
    double area = 0, round = 0;
    for (size_t k = 0; k < count; k++) {
        const double *p = x->points[points[k]], *q = x->points[points[(k + 1) % count]];
        area += .5 * (p[0] * q[1] - p[1] * q[0]);
        round += plane_distance(p, q);
    }
    if (!(2 * fabs(area) > x->narrow * round)) return LAM_OK;
    TRY(array_grow(&r->corners, &r->corner_capacity, r->n_corners + count, sizeof *r->corners, "outlines",
                   error));
    plane_region made = {.first = r->n_corners,
                         .count = count,
                         .area = fabs(area),
                         .level = dot3(x->plane.origin, x->plane.axis[2]),
                         .plane = x->n_planes};
    memcpy(made.normal, x->plane.axis[2], sizeof made.normal);
    for (size_t k = 0; k < count; k++)
        r->corners[r->n_corners++] = x->places[points[area > 0 ? k : count - 1 - k]];
    if (open) {
        TRY(array_grow(&r->open, &r->open_capacity, r->n_open + 1, sizeof *r->open, "outlines", error));
        r->open[r->n_open++] = made;
    } else {
        TRY(array_grow(&r->covered, &r->covered_capacity, r->n_covered + 1, sizeof *r->covered, "outlines",
                       error));
        r->covered[r->n_covered++] = made;
    }
done:
    return status;
}

/* The outline of a plane leaves parts of its convex hull: an opening may be closed by a straight line there.
 */
static lam_status add_pockets(explorer *x, const plane_loop *l, lam_error *error) {
    lam_status status = LAM_OK;
    const uint32_t *points = x->loops.points + l->first;
    TRY(plane_outside_find((const double(*)[2])x->points, l->count, points, x->slack, &x->outside, error));
    for (size_t p = 0; p < x->outside.n; p++) {
        const size_t first = x->outside.first[p];
        TRY(add_region(x, x->outside.first[p + 1] - first, x->outside.points + first, true, error));
    }
done:
    return status;
}

static lam_status look_at_plane(explorer *x, uint32_t face, lam_error *error) {
    lam_status status = LAM_OK;
    bool alone;
    begin_plane(x);
    TRY(explore(x, face, error));
    TRY(find_rims(x, &alone, error));
    const size_t corners = mesh_corners(x->m, face);
    if (alone && x->n_rims == corners && x->n_places == corners) { /* a face with nothing beside it */
        TRY(add_region(x, corners, (const uint32_t[]){0, 1, 2, 3}, false, error));
        return LAM_OK;
    }
    TRY(plane_loops_trace(x->n_places, (const double(*)[2])x->points, x->n_rims, x->rims, &x->loops, error));
    for (size_t k = 0; k < x->loops.n; k++) {
        const plane_loop *l = &x->loops.loops[k];
        if (!l->empty || l->filled) continue;
        TRY(add_region(x, l->count, x->loops.points + l->first, l->area > 0, error));
        if (!(l->area > 0)) TRY(add_pockets(x, l, error));
    }
done:
    return status;
}

typedef struct sized_face {
    double area;
    uint32_t face;
} sized_face;

static int larger_first(const void *a, const void *b) {
    const sized_face *p = a, *q = b;
    if (p->area != q->area) return p->area > q->area ? -1 : 1;
    return (p->face > q->face) - (p->face < q->face);
}

/* All planes of faces. The largest face of each says where it lies. */
static lam_status look_at_planes(explorer *x, lam_error *error) {
    lam_status status = LAM_OK;
    sized_face *sized = memory_allocate(x->n_faces + 1, sizeof *sized, "outlines", error);
    if (sized == NULL) TRY(LAM_ERR_MEMORY);
    for (uint32_t f = 0; f < x->n_faces; f++) sized[f] = (sized_face){x->m->area[f], f};
    array_sort(sized, x->n_faces, sizeof *sized, larger_first);
    for (size_t k = 0; k < x->n_faces; k++) {
        if (x->done[sized[k].face] || !frame_of_face(x->m, sized[k].face, &x->plane)) continue;
        x->done[sized[k].face] = true;
        TRY(look_at_plane(x, sized[k].face, error));
    }
done:
    free(sized);
    return status;
}

/* An edge of one face, in a chain of such edges. */
typedef struct free_edge {
    uint32_t chain, edge;
} free_edge;

static int by_chain(const void *a, const void *b) {
    const free_edge *p = a, *q = b;
    if (p->chain != q->chain) return p->chain < q->chain ? -1 : 1;
    return (p->edge > q->edge) - (p->edge < q->edge);
}

/* The plane of a chain of edges; false where they lie in none, or a face of theirs lies in it, too. */
static bool frame_of_chain(explorer *x, const free_edge *edges, size_t count, double (*points)[3],
                           uint32_t (*ends)[2]) {
    plane_rectangle r;
    for (size_t k = 0; k < count; k++)
        for (int end = 0; end < 2; end++) {
            memcpy(points[2 * k + (size_t)end], x->m->vertices[x->e->ends[edges[k].edge][end]],
                   sizeof *points);
            ends[k][end] = (uint32_t)(2 * k) + (uint32_t)end;
        }
    if (!plane_rectangle_around((const double(*)[3])points, 2 * count, (const uint32_t(*)[2])ends, count,
                                fmax(x->narrow, x->slack), &r))
        return false;
    double *n = x->plane.axis[2];
    cross3(r.edge[0], r.edge[1], n);
    const double length = sqrt(dot3(n, n));
    for (int d = 0; d < 3; d++) n[d] /= length;
    plane_axes(n, x->plane.axis[0], x->plane.axis[1]);
    memcpy(x->plane.origin, points[0], sizeof x->plane.origin);
    for (size_t k = 0; k < count; k++)
        if (turn_in_plane(x, x->e->faces[x->e->first[edges[k].edge]].face) != 0) return false;
    return true;
}

static lam_status look_at_chain(explorer *x, const free_edge *edges, size_t count, lam_error *error) {
    lam_status status = LAM_OK;
    begin_plane(x);
    for (size_t k = 0; k < count; k++) {
        const uint32_t *ends = x->e->ends[edges[k].edge];
        TRY(add_edge(x, edges[k].edge, error));
        TRY(array_grow(&x->rims, &x->rim_capacity, k + 1, sizeof *x->rims, "outlines", error));
        x->rims[k] = (plane_edge){x->local[ends[0]], x->local[ends[1]], SIDE_UNKNOWN, SIDE_UNKNOWN};
    }
    TRY(plane_loops_trace(x->n_places, (const double(*)[2])x->points, count, x->rims, &x->loops, error));
    for (size_t k = 0; k < x->loops.n; k++) {
        const plane_loop *l = &x->loops.loops[k];
        if (l->area > 0) TRY(add_region(x, l->count, x->loops.points + l->first, true, error));
    }
done:
    return status;
}

/* Plane chains of edges of one face each that turn out of the planes of all these faces. */
static lam_status look_at_chains(explorer *x, lam_error *error) {
    lam_status status = LAM_OK;
    const face_edges *e = x->e;
    size_t n = 0;
    uint32_t *parent = memory_allocate(e->n_places + 1, sizeof *parent, "outlines", error);
    free_edge *edges = memory_allocate(e->n + 1, sizeof *edges, "outlines", error);
    double(*points)[3] = NULL;
    uint32_t(*ends)[2] = NULL;
    if (parent == NULL || edges == NULL) TRY(LAM_ERR_MEMORY);
    for (uint32_t p = 0; p < e->n_places; p++) parent[p] = p;
    for (uint32_t k = 0; k < e->n; k++) {
        if (e->first[k + 1] - e->first[k] != 1) continue;
        edges[n++].edge = k;
        (void)union_find_join(parent, e->ends[k][0], e->ends[k][1]);
    }
    for (size_t k = 0; k < n; k++) edges[k].chain = union_find_root(parent, e->ends[edges[k].edge][0]);
    array_sort(edges, n, sizeof *edges, by_chain);
    points = memory_allocate(2 * n + 1, sizeof *points, "outlines", error);
    ends = memory_allocate(n + 1, sizeof *ends, "outlines", error);
    if (points == NULL || ends == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t first = 0, next; first < n; first = next) {
        for (next = first + 1; next < n && edges[next].chain == edges[first].chain;) next++;
        if (next - first >= 3 && frame_of_chain(x, edges + first, next - first, points, ends))
            TRY(look_at_chain(x, edges + first, next - first, error));
    }
done:
    free(parent);
    free(edges);
    free(points);
    free(ends);
    return status;
}

lam_status plane_regions_find(const mesh *m, size_t n_faces, const face_edges *e, double slack, double narrow,
                              plane_regions *out, lam_error *error) {
    lam_status status = LAM_OK;
    plane_regions made = {.n_open = 0};
    explorer x = {.m = m, .e = e, .n_faces = n_faces, .slack = slack, .narrow = narrow, .out = &made};
    x.done = memory_allocate(n_faces + 1, sizeof *x.done, "outlines", error);
    x.edge_stamp = memory_allocate(e->n + 1, sizeof *x.edge_stamp, "outlines", error);
    x.place_stamp = memory_allocate(e->n_places + 1, sizeof *x.place_stamp, "outlines", error);
    x.local = memory_allocate(e->n_places + 1, sizeof *x.local, "outlines", error);
    if (x.done == NULL || x.edge_stamp == NULL || x.place_stamp == NULL || x.local == NULL)
        TRY(LAM_ERR_MEMORY);
    TRY(look_at_planes(&x, error));
    TRY(look_at_chains(&x, error));
    *out = made;
    made = (plane_regions){.n_open = 0};
done:
    free(x.done);
    free(x.edge_stamp);
    free(x.place_stamp);
    free(x.local);
    free(x.places);
    free(x.edges);
    free(x.points);
    free(x.rims);
    plane_loops_free(&x.loops);
    plane_outside_free(&x.outside);
    plane_regions_free(&made);
    return status;
}

void plane_regions_free(plane_regions *r) {
    free(r->open);
    free(r->covered);
    free(r->corners);
    *r = (plane_regions){.n_open = 0};
}
