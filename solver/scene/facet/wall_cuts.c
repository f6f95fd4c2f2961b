#include "solver/scene/facet/wall_cuts.h"

#include "solver/base/array_grow.h"
#include "solver/base/array_sort.h"
#include "solver/scene/facet/standing_edges.h"
#include "solver/scene/mesh_cells.h"
#include "solver/scene/plane.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Corners of a part while it is cut; more of them are divided first. */
enum { PART_CORNERS = 12 };

#define NONE UINT32_MAX

typedef struct part_corner {
    double flat[2], at[3]; /* in the frame of the face; m */
} part_corner;

/* A convex part of a face. */
typedef struct face_part {
    uint32_t face, n, next; /* next: of the same face, or NONE */
    part_corner corner[PART_CORNERS];
} face_part;

/* A part, or a cut and what lies on its left and on its right. */
typedef struct cut_node {
    uint32_t part; /* NONE: it is a cut */
    uint32_t child[2];
    flat_line line;
} cut_node;

/* A piece of an edge that is looked for below a node. */
typedef struct descent {
    uint32_t node;
    double from[2], to[2];
} descent;

typedef struct cutter {
    const mesh *m;
    size_t n_faces, most; /* pieces of 3 or 4 corners that there are, and may be */
    bool full;
    uint32_t *root; /* [m->n], a node, or NONE: the face is whole */
    uint32_t *head; /* [m->n], the first part of a face that has a node */
    face_part *parts;
    cut_node *nodes;
    descent *stack;
    size_t n_parts, part_capacity, n_nodes, node_capacity, stack_capacity;
} cutter;

/* Pieces of 3 or 4 corners that a polygon makes. */
static size_t pieces_of(size_t corners) {
    return corners <= 4 ? 1 : (corners - 1) / 2;
}

static double part_area(const face_part *p) {
    double twice = 0;
    for (size_t k = 1; k + 1 < p->n; k++)
        twice += plane_turn(p->corner[0].flat, p->corner[k].flat, p->corner[k + 1].flat);
    return twice / 2;
}

static lam_status begin_face(cutter *c, uint32_t face, lam_error *error) {
    lam_status status = LAM_OK;
    const face_frame frame = face_frame_of(c->m, face);
    face_part whole = {.face = face, .n = (uint32_t)mesh_corners(c->m, face), .next = NONE};
    TRY(array_grow(&c->parts, &c->part_capacity, c->n_parts + 1, sizeof *c->parts, "parts of faces", error));
    TRY(array_grow(&c->nodes, &c->node_capacity, c->n_nodes + 1, sizeof *c->nodes, "parts of faces", error));
    for (size_t k = 0; k < whole.n; k++) {
        memcpy(whole.corner[k].at, c->m->vertices[c->m->elements[face][k]], sizeof whole.corner[k].at);
        face_frame_flatten(&frame, whole.corner[k].at, whole.corner[k].flat);
    }
    c->root[face] = (uint32_t)c->n_nodes;
    c->head[face] = (uint32_t)c->n_parts;
    c->nodes[c->n_nodes++] = (cut_node){.part = (uint32_t)c->n_parts};
    c->parts[c->n_parts++] = whole;
done:
    return status;
}

/* The distances of corners from a line; those within a tolerance are on it, so that no cut ends beside a
 * corner, but no two that follow each other. False where no corner is left on either side. */
static bool sides_of(const face_part *p, const flat_line *line, double tolerance, double *distance) {
    double least = 0, most = 0;
    for (size_t k = 0; k < p->n; k++) {
        distance[k] = flat_line_distance(line, p->corner[k].flat);
        least = fmin(least, distance[k]);
        most = fmax(most, distance[k]);
    }
    if (!(most > tolerance && least < -tolerance)) return false;
    for (size_t k = 0; k < p->n; k++) {
        const double before = fabs(distance[(k + p->n - 1) % p->n]), after = fabs(distance[(k + 1) % p->n]);
        if (fabs(distance[k]) <= tolerance && fabs(distance[k]) < before && fabs(distance[k]) <= after)
            distance[k] = 0;
    }
    return true;
}

/* The parts on the left and on the right; false where one has too many corners. */
static bool divide(const face_part *p, const double *distance, face_part out[2]) {
    for (int side = 0; side < 2; side++) {
        face_part *to = &out[side];
        *to = (face_part){.face = p->face, .next = NONE};
        for (size_t k = 0; k < p->n; k++) {
            const part_corner *a = &p->corner[k], *b = &p->corner[(k + 1) % p->n];
            const double here = distance[k], there = distance[(k + 1) % p->n];
            if (side == 0 ? here >= 0 : here <= 0) {
                if (to->n == PART_CORNERS) return false;
                to->corner[to->n++] = *a;
            }
            if (!(here * there < 0)) continue;
            if (to->n == PART_CORNERS) return false;
            part_corner *x = &to->corner[to->n++];
            const double share = here / (here - there);
            for (int d = 0; d < 2; d++) x->flat[d] = a->flat[d] + share * (b->flat[d] - a->flat[d]);
            for (int d = 0; d < 3; d++) x->at[d] = a->at[d] + share * (b->at[d] - a->at[d]);
        }
    }
    return true;
}

/* Cuts the part of a node by a line, unless it is too small for it. *made tells it. */
static lam_status cut_part(cutter *c, uint32_t node, const flat_line *line, double tolerance, bool *made,
                           lam_error *error) {
    lam_status status = LAM_OK;
    const uint32_t index = c->nodes[node].part;
    double distance[PART_CORNERS];
    face_part out[2];
    *made = false;
    if (!sides_of(&c->parts[index], line, tolerance, distance)) goto done;
    if (!divide(&c->parts[index], distance, out)) goto done;
    const double least = MESH_CELL_LEAST * c->m->area[out[0].face];
    if (!(part_area(&out[0]) >= least && part_area(&out[1]) >= least)) goto done;
    const size_t n_faces =
        c->n_faces - pieces_of(c->parts[index].n) + pieces_of(out[0].n) + pieces_of(out[1].n);
    c->full = n_faces > c->most;
    if (c->full) goto done;
    TRY(array_grow(&c->parts, &c->part_capacity, c->n_parts + 1, sizeof *c->parts, "parts of faces", error));
    TRY(array_grow(&c->nodes, &c->node_capacity, c->n_nodes + 2, sizeof *c->nodes, "parts of faces", error));
    out[1].next = c->parts[index].next;
    out[0].next = (uint32_t)c->n_parts;
    c->parts[index] = out[0];
    c->parts[c->n_parts] = out[1];
    c->nodes[node] = (cut_node){NONE, {(uint32_t)c->n_nodes, (uint32_t)c->n_nodes + 1}, *line};
    c->nodes[c->n_nodes++] = (cut_node){.part = index};
    c->nodes[c->n_nodes++] = (cut_node){.part = (uint32_t)c->n_parts++};
    c->n_faces = n_faces;
    *made = true;
done:
    return status;
}

/* 4 sqrt(3) area / squared lengths of sides summed: 1 of an equilateral triangle, 0 of a sliver. */
static double roundness(const face_part *p) {
    double squares = 0;
    for (size_t k = 0; k < p->n; k++) {
        const double length = plane_distance(p->corner[k].flat, p->corner[(k + 1) % p->n].flat);
        squares += length * length;
    }
    return 4 * sqrt(3.0) * part_area(p) / squares;
}

static face_part part_between(const face_part *p, size_t from, size_t to) {
    face_part out = {.face = p->face, .next = NONE};
    for (size_t k = from;; k = (k + 1) % p->n) {
        out.corner[out.n++] = p->corner[k];
        if (k == to) return out;
    }
}

/* Divides a polygon of more than four corners along the diagonal that leaves the roundest parts, of those
 * that make no more pieces than it must have. */
static void halve(const face_part *p, face_part out[2], size_t diagonal[2]) {
    double best = -1;
    for (size_t i = 0; i < p->n; i++)
        for (size_t j = i + 2; j < p->n; j++) {
            if (i == 0 && j == p->n - 1u) continue;
            const face_part a = part_between(p, i, j), b = part_between(p, j, i);
            if (pieces_of(a.n) + pieces_of(b.n) > pieces_of(p->n)) continue;
            const double worse = fmin(roundness(&a), roundness(&b));
            if (!(worse > best)) continue;
            best = worse;
            out[0] = a;
            out[1] = b;
            diagonal[0] = i;
            diagonal[1] = j;
        }
}

/* Cuts a part that has as many corners as there is room for, so that it can be cut along a wall. */
static lam_status make_room(cutter *c, uint32_t node, double tolerance, bool *made, lam_error *error) {
    const face_part p = c->parts[c->nodes[node].part];
    face_part halves[2];
    size_t diagonal[2] = {0, 0};
    halve(&p, halves, diagonal);
    const flat_line line = flat_line_through(p.corner[diagonal[0]].flat, p.corner[diagonal[1]].flat);
    return cut_part(c, node, &line, tolerance, made, error);
}

static lam_status push(cutter *c, size_t *n, descent d, lam_error *error) {
    if (array_grow(&c->stack, &c->stack_capacity, *n + 1, sizeof *c->stack, "parts of faces", error) !=
        LAM_OK)
        return LAM_ERR_MEMORY;
    c->stack[(*n)++] = d;
    return LAM_OK;
}

/* Goes on with the pieces of an edge on the sides of a cut. An edge along it needs no other one. */
static lam_status descend(cutter *c, size_t *n, const descent *d, double tolerance, lam_error *error) {
    lam_status status = LAM_OK;
    const cut_node at = c->nodes[d->node];
    const double from = flat_line_distance(&at.line, d->from), to = flat_line_distance(&at.line, d->to);
    if (fabs(from) <= tolerance && fabs(to) <= tolerance) goto done;
    descent left = *d, right = *d;
    left.node = at.child[0];
    right.node = at.child[1];
    if (fmin(from, to) < -tolerance && fmax(from, to) > tolerance) {
        double x[2];
        for (int k = 0; k < 2; k++) x[k] = d->from[k] + from / (from - to) * (d->to[k] - d->from[k]);
        memcpy(from > 0 ? left.to : left.from, x, sizeof x);
        memcpy(from > 0 ? right.from : right.to, x, sizeof x);
    }
    if (fmax(from, to) > tolerance) TRY(push(c, n, left, error));
    if (fmin(from, to) < -tolerance) TRY(push(c, n, right, error));
done:
    return status;
}

/* Cuts the parts of a face that an edge runs through. */
static lam_status cut_along(cutter *c, const standing_edge *e, lam_error *error) {
    lam_status status = LAM_OK;
    size_t n = 0;
    descent first = {.node = c->root[e->face]};
    memcpy(first.from, e->from, sizeof first.from);
    memcpy(first.to, e->to, sizeof first.to);
    TRY(push(c, &n, first, error));
    while (n > 0 && !c->full) {
        descent d = c->stack[--n];
        bool made;
        if (c->nodes[d.node].part == NONE) {
            TRY(descend(c, &n, &d, e->tolerance, error));
            continue;
        }
        const face_part *p = &c->parts[c->nodes[d.node].part];
        double flat[PART_CORNERS][2];
        for (size_t k = 0; k < p->n; k++) memcpy(flat[k], p->corner[k].flat, sizeof flat[k]);
        if (!segment_clip(p->n, (const double(*)[2])flat, d.from, d.to)) continue;
        if (!(plane_distance(d.from, d.to) > e->tolerance)) continue;
        if (p->n == PART_CORNERS) {
            TRY(make_room(c, d.node, e->tolerance, &made, error));
            if (made) TRY(push(c, &n, d, error));
            continue;
        }
        TRY(cut_part(c, d.node, &e->line, e->tolerance, &made, error));
    }
done:
    return status;
}

static mesh_cell cell_of(const face_part *p) {
    mesh_cell c = {.face = p->face, .n = p->n};
    for (size_t k = 0; k < p->n; k++) memcpy(c.corner[k], p->corner[k].at, sizeof c.corner[k]);
    return c;
}

/* Appends a part as cells of 3 or 4 corners. Depth: log2 of its corners. */
static void add_cells(const face_part *p, mesh_cell *cells, size_t *n) {
    face_part halves[2];
    size_t diagonal[2];
    if (p->n <= 4) {
        cells[(*n)++] = cell_of(p);
        return;
    }
    halve(p, halves, diagonal);
    for (int k = 0; k < 2; k++) add_cells(&halves[k], cells, n);
}

static lam_status replace(mesh *m, const cutter *c, wall_cuts_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    mesh made = {0};
    size_t n = 0;
    mesh_cell *cells = memory_allocate(c->n_faces, sizeof *cells, "parts of faces", error);
    if (cells == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < m->n; i++) {
        const size_t before = n;
        if (c->root[i] == NONE) {
            cells[n++] = mesh_cell_of(m, i);
            continue;
        }
        for (uint32_t p = c->head[i]; p != NONE; p = c->parts[p].next) add_cells(&c->parts[p], cells, &n);
        if (n - before == 1) continue;
        report->faces++;
        report->parts += n - before;
    }
    TRY(mesh_of_cells(m, n, cells, &made, error));
    mesh_replace(m, &made);
done:
    free(cells);
    return status;
}

static int by_length(const void *a, const void *b) {
    const standing_edge *p = a, *q = b;
    if (p->reach != q->reach) return p->reach > q->reach ? -1 : 1;
    const double one = plane_distance(p->from, p->to), other = plane_distance(q->from, q->to);
    if (one != other) return one > other ? -1 : 1;
    if (p->face != q->face) return p->face < q->face ? -1 : 1;
    for (int end = 0; end < 2; end++)
        for (int d = 0; d < 2; d++)
            if (p->whole[end][d] != q->whole[end][d]) return p->whole[end][d] < q->whole[end][d] ? -1 : 1;
    return 0;
}

lam_status faces_cut_at_walls(mesh *m, double least, size_t most, wall_cuts_report *report,
                              lam_error *error) {
    lam_status status = LAM_OK;
    standing_edges e = {.n = 0};
    cutter c = {.m = m, .n_faces = m->n, .most = most};
    wall_cuts_report made = {.faces = 0};
    size_t n = 0;
    if (m->n_backs > 0) FAIL(error, LAM_ERR_ARGUMENT, "mesh: cut it before making it two-sided");
    TRY(standing_edges_find(m, &e, error));
    for (size_t k = 0; k < e.n; k++)
        if (e.edges[k].reach >= least && face_diameter(m, e.edges[k].face) >= least)
            e.edges[n++] = e.edges[k];
    if (n > 0) {
        array_sort(e.edges, n, sizeof *e.edges, by_length);
        c.root = memory_allocate(m->n, sizeof *c.root, "parts of faces", error);
        c.head = memory_allocate(m->n, sizeof *c.head, "parts of faces", error);
        if (c.root == NULL || c.head == NULL) TRY(LAM_ERR_MEMORY);
        for (size_t i = 0; i < m->n; i++) c.root[i] = NONE;
        for (size_t k = 0; k < n && !c.full; k++) {
            if (c.root[e.edges[k].face] == NONE) TRY(begin_face(&c, e.edges[k].face, error));
            TRY(cut_along(&c, &e.edges[k], error));
            if (c.full) made.left = n - k;
        }
        if (c.n_faces > m->n) TRY(replace(m, &c, &made, error));
    }
    *report = made;
done:
    free(e.edges);
    free(c.root);
    free(c.head);
    free(c.parts);
    free(c.nodes);
    free(c.stack);
    return status;
}

lam_status elements_under_walls(const mesh *m, size_t *n, lam_error *error) {
    lam_status status = LAM_OK;
    standing_edges e = {.n = 0};
    size_t under = 0;
    uint32_t last = NONE;
    TRY(standing_edges_find(m, &e, error));
    for (size_t k = 0; k < e.n; k++) {
        const uint32_t face = e.edges[k].face;
        if (face == last || !(e.edges[k].extent >= .5 * m->area[face] / face_diameter(m, face))) continue;
        under++;
        last = face;
    }
    *n = under;
done:
    free(e.edges);
    return status;
}
