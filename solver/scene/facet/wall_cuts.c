#include "solver/scene/facet/wall_cuts.h"

#include "solver/base/array_grow.h"
#include "solver/base/array_sort.h"
#include "solver/scene/face_part.h"
#include "solver/scene/facet/standing_edges.h"
#include "solver/scene/plane.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A part, or a cut and what lies on its left and on its right. */
typedef struct cut_node {
    uint32_t part; /* FACE_PART_NONE: it is a cut */
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
    uint32_t *root; /* [m->n], a node, or FACE_PART_NONE: the face is whole */
    uint32_t *head; /* [m->n], the first part of a face that has a node */
    face_part *parts;
    cut_node *nodes;
    descent *stack;
    size_t n_parts, part_capacity, n_nodes, node_capacity, stack_capacity;
} cutter;

static lam_status begin_face(cutter *c, uint32_t face, lam_error *error) {
    lam_status status = LAM_OK;
    const face_frame frame = face_frame_of(c->m, face);
    const face_part whole = face_part_of(c->m, face, &frame);
    TRY(array_grow(&c->parts, &c->part_capacity, c->n_parts + 1, sizeof *c->parts, "parts of faces", error));
    TRY(array_grow(&c->nodes, &c->node_capacity, c->n_nodes + 1, sizeof *c->nodes, "parts of faces", error));
    c->root[face] = (uint32_t)c->n_nodes;
    c->head[face] = (uint32_t)c->n_parts;
    c->nodes[c->n_nodes++] = (cut_node){.part = (uint32_t)c->n_parts};
    c->parts[c->n_parts++] = whole;
done:
    return status;
}

/* Cuts the part of a node by a line, unless it is too small for it. *made tells it. */
static lam_status cut_part(cutter *c, uint32_t node, const flat_line *line, double tolerance, bool *made,
                           lam_error *error) {
    lam_status status = LAM_OK;
    const uint32_t index = c->nodes[node].part;
    double distance[FACE_PART_CORNERS];
    face_part out[2];
    *made = false;
    if (!face_part_sides(&c->parts[index], line, tolerance, distance)) goto done;
    if (!face_part_divide(&c->parts[index], distance, out)) goto done;
    const double least = MESH_CELL_LEAST * c->m->area[out[0].face];
    if (!(face_part_area(&out[0]) >= least && face_part_area(&out[1]) >= least)) goto done;
    const size_t n_faces = c->n_faces - face_part_pieces(c->parts[index].n) + face_part_pieces(out[0].n) +
                           face_part_pieces(out[1].n);
    c->full = n_faces > c->most;
    if (c->full) goto done;
    TRY(array_grow(&c->parts, &c->part_capacity, c->n_parts + 1, sizeof *c->parts, "parts of faces", error));
    TRY(array_grow(&c->nodes, &c->node_capacity, c->n_nodes + 2, sizeof *c->nodes, "parts of faces", error));
    out[1].next = c->parts[index].next;
    out[0].next = (uint32_t)c->n_parts;
    c->parts[index] = out[0];
    c->parts[c->n_parts] = out[1];
    c->nodes[node] = (cut_node){FACE_PART_NONE, {(uint32_t)c->n_nodes, (uint32_t)c->n_nodes + 1}, *line};
    c->nodes[c->n_nodes++] = (cut_node){.part = index};
    c->nodes[c->n_nodes++] = (cut_node){.part = (uint32_t)c->n_parts++};
    c->n_faces = n_faces;
    *made = true;
done:
    return status;
}

/* Cuts a part that has as many corners as there is room for, so that it can be cut along a wall. */
static lam_status make_room(cutter *c, uint32_t node, double tolerance, bool *made, lam_error *error) {
    const face_part p = c->parts[c->nodes[node].part];
    face_part halves[2];
    size_t diagonal[2] = {0, 0};
    face_part_halve(&p, halves, diagonal);
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
        if (c->nodes[d.node].part == FACE_PART_NONE) {
            TRY(descend(c, &n, &d, e->tolerance, error));
            continue;
        }
        const face_part *p = &c->parts[c->nodes[d.node].part];
        double flat[FACE_PART_CORNERS][2];
        for (size_t k = 0; k < p->n; k++) memcpy(flat[k], p->corner[k].flat, sizeof flat[k]);
        if (!segment_clip(p->n, (const double(*)[2])flat, d.from, d.to)) continue;
        if (!(plane_distance(d.from, d.to) > e->tolerance)) continue;
        if (p->n == FACE_PART_CORNERS) {
            TRY(make_room(c, d.node, e->tolerance, &made, error));
            if (made) TRY(push(c, &n, d, error));
            continue;
        }
        TRY(cut_part(c, d.node, &e->line, e->tolerance, &made, error));
    }
done:
    return status;
}

static lam_status replace(mesh *m, const cutter *c, wall_cuts_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    mesh made = {0};
    size_t n = 0;
    mesh_cell *cells = memory_allocate(c->n_faces, sizeof *cells, "parts of faces", error);
    if (cells == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < m->n; i++) {
        const size_t before = n;
        if (c->root[i] == FACE_PART_NONE) {
            cells[n++] = mesh_cell_of(m, i);
            continue;
        }
        for (uint32_t p = c->head[i]; p != FACE_PART_NONE; p = c->parts[p].next)
            face_part_cells(&c->parts[p], cells, &n);
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
        for (size_t i = 0; i < m->n; i++) c.root[i] = FACE_PART_NONE;
        for (size_t k = 0; k < n && !c.full; k++) {
            if (c.root[e.edges[k].face] == FACE_PART_NONE) TRY(begin_face(&c, e.edges[k].face, error));
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
    uint32_t last = FACE_PART_NONE;
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
