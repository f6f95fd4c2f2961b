#include "solver/scene/facet/standing_edges.h"

#include "solver/base/array_grow.h"
#include "solver/base/union_find.h"
#include "solver/base/vector3.h"
#include "solver/scene/box_pairs.h"
#include "solver/scene/element_face.h"
#include "solver/scene/plane.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct search {
    const mesh *m;
    double slack;    /* m, the distance of a plane or an edge within which a corner lies in it */
    double rounding; /* m, of corners */
    double *width;   /* [n], m, of elements */
    standing_edges *out;
} search;

double face_diameter(const mesh *m, size_t face) {
    double square = 0;
    const size_t corners = mesh_corners(m, face);
    for (size_t a = 0; a < corners; a++)
        for (size_t b = 0; b < a; b++) {
            double between[3];
            subtract3(m->vertices[m->elements[face][a]], m->vertices[m->elements[face][b]], between);
            square = fmax(square, dot3(between, between));
        }
    return sqrt(square);
}

bool segment_clip(size_t n, const double (*corner)[2], double from[2], double to[2]) {
    double first = 0, last = 1;
    for (size_t k = 0; k < n; k++) {
        const double here = plane_turn(corner[k], corner[(k + 1) % n], from);
        const double there = plane_turn(corner[k], corner[(k + 1) % n], to);
        if (here < 0 && there < 0) return false;
        if (here < 0) first = fmax(first, here / (here - there));
        if (there < 0) last = fmin(last, here / (here - there));
    }
    if (!(first < last)) return false;
    const double a[2] = {from[0], from[1]}, b[2] = {to[0], to[1]};
    for (int d = 0; d < 2; d++) {
        from[d] = a[d] + first * (b[d] - a[d]);
        to[d] = last < 1 ? a[d] + last * (b[d] - a[d]) : b[d];
    }
    return true;
}

/* The ends of the part of a face that lies in a plane, given the heights of its corners above that, those of
 * corners in the plane being 0: two corners, or places between two corners on either side. False where they
 * are less than two. */
static bool crossing(const mesh *m, uint32_t face, size_t n, const double *height, double ends[2][3]) {
    size_t found = 0;
    for (size_t k = 0; k < n && found < 2; k++) {
        const size_t next = (k + 1) % n;
        const double *a = m->vertices[m->elements[face][k]], *b = m->vertices[m->elements[face][next]];
        if (height[k] == 0) memcpy(ends[found++], a, sizeof ends[0]);
        if (found < 2 && height[k] * height[next] < 0) {
            for (int d = 0; d < 3; d++)
                ends[found][d] = a[d] + height[k] / (height[k] - height[next]) * (b[d] - a[d]);
            found++;
        }
    }
    return found == 2;
}

/* Adds the edge along which a face stands on another one, where it does. */
static lam_status stand(const search *s, uint32_t on, uint32_t wall, lam_error *error) {
    const mesh *m = s->m;
    const size_t n = mesh_corners(m, wall), corners = mesh_corners(m, on);
    const float *p = m->normal[on], *q = m->normal[wall];
    const double *origin = m->vertices[m->elements[on][0]];
    double height[4], highest = 0, lowest = 0, uncertain = s->slack, ends[2][3], flat[4][2], least = 0,
                      most = 0;
    standing_edge e = {.face = on};
    for (size_t k = 0; k < n; k++) {
        const double *v = m->vertices[m->elements[wall][k]];
        double to[3];
        height[k] = 0;
        for (int d = 0; d < 3; d++) {
            to[d] = v[d] - origin[d];
            height[k] += to[d] * (double)p[d];
        }
        const double high = fabs(height[k]);
        /* Rounding tilts the plane of a small face, which a large wall shows far away. */
        if (high > s->slack && high > s->rounding * sqrt(dot3(to, to)) / s->width[on]) {
            highest = fmax(highest, height[k]);
            lowest = fmin(lowest, height[k]);
            continue;
        }
        uncertain = fmax(uncertain, high);
        height[k] = 0;
    }
    if (!(highest > 0) && !(lowest < 0 && m->has_back != NULL && m->has_back[on])) return LAM_OK;
    if (!crossing(m, wall, n, height, ends)) return LAM_OK;
    const face_frame frame = face_frame_of(m, on);
    for (size_t k = 0; k < corners; k++) face_frame_flatten(&frame, m->vertices[m->elements[on][k]], flat[k]);
    for (int end = 0; end < 2; end++) face_frame_flatten(&frame, ends[end], e.whole[end]);
    if (!(plane_distance(e.whole[0], e.whole[1]) > s->slack)) return LAM_OK;
    /* A height is off by as much as was taken for 0, and the line by that over the sine between the planes.
     */
    double cosine = 0;
    for (int d = 0; d < 3; d++) cosine += (double)p[d] * (double)q[d];
    e.tolerance = uncertain / sqrt(fmax(1 - cosine * cosine, 1e-12));
    e.line = flat_line_through(e.whole[0], e.whole[1]);
    for (size_t k = 0; k < corners; k++) {
        const double distance = flat_line_distance(&e.line, flat[k]);
        most = fmax(most, distance);
        least = fmin(least, distance);
    }
    if (!(most > e.tolerance && least < -e.tolerance)) return LAM_OK;
    memcpy(e.from, e.whole[0], sizeof e.from);
    memcpy(e.to, e.whole[1], sizeof e.to);
    if (!segment_clip(corners, (const double(*)[2])flat, e.from, e.to)) return LAM_OK;
    if (!(plane_distance(e.from, e.to) > e.tolerance) || elements_share_plane(m, on, wall)) return LAM_OK;
    standing_edges *out = s->out;
    if (array_grow(&out->edges, &out->capacity, out->n + 1, sizeof *out->edges, "edges of walls", error) !=
        LAM_OK)
        return LAM_ERR_MEMORY;
    out->edges[out->n++] = e;
    return LAM_OK;
}

static lam_status look(void *context, uint32_t i, uint32_t j, lam_error *error) {
    const search *s = context;
    const size_t n_fronts = s->m->n - s->m->n_backs;
    lam_status status = LAM_OK;
    if (i >= n_fronts || j >= n_fronts) return LAM_OK;
    TRY(stand(s, i, j, error));
    TRY(stand(s, j, i, error));
done:
    return status;
}

static int by_face(const void *a, const void *b) {
    const standing_edge *p = a, *q = b;
    if (p->face != q->face) return p->face < q->face ? -1 : 1;
    for (int end = 0; end < 2; end++)
        for (int d = 0; d < 2; d++)
            if (p->whole[end][d] != q->whole[end][d]) return p->whole[end][d] < q->whole[end][d] ? -1 : 1;
    return p->tolerance != q->tolerance ? p->tolerance < q->tolerance ? -1 : 1 : 0;
}

/* An end of an edge, and how far it is in a direction in which few ends are equally far. */
typedef struct edge_end {
    double along;
    const double *at;
    uint32_t edge;
} edge_end;

static int by_place(const void *a, const void *b) {
    const edge_end *p = a, *q = b;
    if (p->along != q->along) return p->along < q->along ? -1 : 1;
    return (p->edge > q->edge) - (p->edge < q->edge);
}

/* The corners of a box around edges. */
typedef struct flat_box {
    double low[2], high[2];
} flat_box;

static void add_to_box(flat_box *b, const double x[2]) {
    for (int d = 0; d < 2; d++) {
        b->low[d] = fmin(b->low[d], x[d]);
        b->high[d] = fmax(b->high[d], x[d]);
    }
}

/* Sets the extents of the n edges of one face. ends and boxes [2n] and parent [n] are
 * scratch. */
static void connect(standing_edge *edges, size_t n, double slack, edge_end *ends, uint32_t *parent,
                    flat_box *boxes) {
    for (size_t k = 0; k < n; k++) {
        parent[k] = (uint32_t)k;
        for (int end = 0; end < 2; end++) {
            const double *at = edges[k].whole[end];
            ends[2 * k + (size_t)end] = (edge_end){.6180 * at[0] + .7862 * at[1], at, (uint32_t)k};
        }
    }
    qsort(ends, 2 * n, sizeof *ends, by_place);
    for (size_t k = 0; k < 2 * n; k++)
        for (size_t l = k + 1; l < 2 * n && ends[l].along - ends[k].along <= slack; l++)
            if (plane_distance(ends[k].at, ends[l].at) <= slack)
                union_find_join(parent, ends[k].edge, ends[l].edge);
    const flat_box none = {{HUGE_VAL, HUGE_VAL}, {-HUGE_VAL, -HUGE_VAL}};
    for (size_t k = 0; k < 2 * n; k++) boxes[k] = none;
    for (size_t k = 0; k < n; k++) {
        flat_box *b = &boxes[2 * union_find_root(parent, (uint32_t)k)];
        add_to_box(&b[0], edges[k].from);
        add_to_box(&b[0], edges[k].to);
        for (int end = 0; end < 2; end++) add_to_box(&b[1], edges[k].whole[end]);
    }
    for (size_t k = 0; k < n; k++) {
        const flat_box *b = &boxes[2 * union_find_root(parent, (uint32_t)k)];
        edges[k].extent = plane_distance(b[0].low, b[0].high);
        edges[k].reach = plane_distance(b[1].low, b[1].high);
    }
}

static lam_status connect_all(standing_edges *e, double slack, lam_error *error) {
    lam_status status = LAM_OK;
    edge_end *ends = memory_allocate(e->n, 2 * sizeof *ends, "edges of walls", error);
    uint32_t *parent = memory_allocate(e->n, sizeof *parent, "edges of walls", error);
    flat_box *boxes = memory_allocate(e->n, 2 * sizeof *boxes, "edges of walls", error);
    if (ends == NULL || parent == NULL || boxes == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t first = 0, last = 0; first < e->n; first = last) {
        while (last < e->n && e->edges[last].face == e->edges[first].face) last++;
        connect(e->edges + first, last - first, slack, ends, parent, boxes);
    }
done:
    free(ends);
    free(parent);
    free(boxes);
    return status;
}

lam_status standing_edges_find(const mesh *m, standing_edges *out, lam_error *error) {
    lam_status status = LAM_OK;
    standing_edges found = {.n = 0};
    double centre[3], radius;
    mesh_bounds(m, centre, &radius);
    search s = {.m = m,
                .slack = plane_flatness * 2 * radius,
                .rounding = plane_same_place * radius,
                .width = memory_allocate(m->n, sizeof *s.width, "edges of walls", error),
                .out = &found};
    const box_pairs how = {
        .distance = s.slack, .least = s.slack, .long_axes = 1, .visit = look, .context = &s};
    if (s.width == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < m->n; i++) s.width[i] = m->area[i] / face_diameter(m, i);
    TRY(box_pairs_visit(m, &how, &found.cut, error));
    if (found.n > 0) {
        qsort(found.edges, found.n, sizeof *found.edges, by_face);
        TRY(connect_all(&found, s.slack, error));
    }
    *out = found;
    found = (standing_edges){.n = 0};
done:
    free(s.width);
    free(found.edges);
    return status;
}
