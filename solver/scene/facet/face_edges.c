#include "solver/scene/facet/face_edges.h"

#include "solver/base/array_grow.h"
#include "solver/base/array_sort.h"
#include "solver/scene/facet/place_grid.h"
#include "solver/scene/tables.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A piece of the side of a face. */
typedef struct side_piece {
    uint32_t low, high;
    edge_face of;
} side_piece;

/* A place on a side. */
typedef struct side_cut {
    double along;
    uint32_t place;
} side_cut;

typedef struct cutter {
    const mesh *m;
    double slack;
    uint32_t *place;
    place_grid grid;
    uint32_t centre, from, to; /* a place to weld, or a side to cut, while points are visited */
    side_cut *cuts;
    side_piece *pieces;
    size_t n_cuts, cut_capacity, n_pieces, piece_capacity;
} cutter;

static double squared_distance(const double a[3], const double b[3]) {
    double sum = 0;
    for (int d = 0; d < 3; d++) sum += (a[d] - b[d]) * (a[d] - b[d]);
    return sum;
}

static lam_status weld_one(void *context, uint32_t other, lam_error *error) {
    cutter *c = context;
    (void)error;
    if (other > c->centre && c->place[other] == other &&
        squared_distance(c->m->vertices[c->centre], c->m->vertices[other]) <= c->slack * c->slack)
        c->place[other] = c->centre;
    return LAM_OK;
}

/* Places are the vertices that no earlier place is near. */
static lam_status weld(cutter *c, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = c->m->n_vertices;
    const double(*points)[3] = (const double(*)[3])c->m->vertices;
    place_grid all = {.cell = 0};
    TRY(points_weld(n, points, c->place, error));
    TRY(place_grid_create(n, points, c->place, &all, error));
    for (uint32_t v = 0; v < n; v++) {
        c->centre = v;
        if (c->place[v] == v)
            TRY(place_grid_along(&all, points[v], points[v], c->slack, weld_one, c, error));
        else /* equal points: the first of them may have been moved since, and comes before */
            c->place[v] = c->place[c->place[v]];
    }
    TRY(place_grid_create(n, points, c->place, &c->grid, error));
done:
    place_grid_free(&all);
    return status;
}

static lam_status cut_at(void *context, uint32_t place, lam_error *error) {
    cutter *c = context;
    if (place == c->from || place == c->to) return LAM_OK;
    const double *p = c->m->vertices[c->from], *q = c->m->vertices[c->to], *x = c->m->vertices[place];
    double along = 0, length = 0, off = 0;
    for (int d = 0; d < 3; d++) {
        along += (x[d] - p[d]) * (q[d] - p[d]);
        length += (q[d] - p[d]) * (q[d] - p[d]);
    }
    if (!(along > 0 && along < length)) return LAM_OK;
    for (int d = 0; d < 3; d++) {
        const double e = x[d] - p[d] - along / length * (q[d] - p[d]);
        off += e * e;
    }
    if (off > c->slack * c->slack) return LAM_OK;
    if (array_grow(&c->cuts, &c->cut_capacity, c->n_cuts + 1, sizeof *c->cuts, "edges of faces", error) !=
        LAM_OK)
        return LAM_ERR_MEMORY;
    c->cuts[c->n_cuts++] = (side_cut){along, place};
    return LAM_OK;
}

static int by_place_along(const void *a, const void *b) {
    const side_cut *p = a, *q = b;
    if (p->along != q->along) return p->along < q->along ? -1 : 1;
    return (p->place > q->place) - (p->place < q->place);
}

static lam_status add_piece(cutter *c, uint32_t face, uint32_t from, uint32_t to, lam_error *error) {
    if (array_grow(&c->pieces, &c->piece_capacity, c->n_pieces + 1, sizeof *c->pieces, "edges of faces",
                   error) != LAM_OK)
        return LAM_ERR_MEMORY;
    c->pieces[c->n_pieces++] =
        (side_piece){.low = from < to ? from : to, .high = from < to ? to : from, .of = {face, from < to}};
    return LAM_OK;
}

/* The side between two places, from the lower one, so that both of its faces cut it in the same way. */
static lam_status cut_side(cutter *c, uint32_t face, uint32_t from, uint32_t to, lam_error *error) {
    lam_status status = LAM_OK;
    const bool forward = from < to;
    c->from = forward ? from : to;
    c->to = forward ? to : from;
    c->n_cuts = 0;
    TRY(place_grid_along(&c->grid, c->m->vertices[c->from], c->m->vertices[c->to], c->slack, cut_at, c,
                         error));
    if (c->n_cuts > 1) qsort(c->cuts, c->n_cuts, sizeof *c->cuts, by_place_along);
    uint32_t last = c->from;
    for (size_t k = 0; k <= c->n_cuts; k++) {
        const uint32_t next = k < c->n_cuts ? c->cuts[k].place : c->to;
        TRY(add_piece(c, face, forward ? last : next, forward ? next : last, error));
        last = next;
    }
done:
    return status;
}

static int by_ends(const void *a, const void *b) {
    const side_piece *p = a, *q = b;
    if (p->low != q->low) return p->low < q->low ? -1 : 1;
    if (p->high != q->high) return p->high < q->high ? -1 : 1;
    if (p->of.face != q->of.face) return p->of.face < q->of.face ? -1 : 1;
    return (int)p->of.forward - (int)q->of.forward;
}

/* Pieces, sorted, as edges with their faces, and the edges of each place. */
static lam_status gather(const cutter *c, face_edges *e, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = c->n_pieces;
    e->ends = memory_allocate(n + 1, sizeof *e->ends, "edges of faces", error);
    e->first = memory_allocate(n + 1, sizeof *e->first, "edges of faces", error);
    e->faces = memory_allocate(n + 1, sizeof *e->faces, "edges of faces", error);
    e->first_at = memory_allocate(e->n_places + 2, sizeof *e->first_at, "edges of faces", error);
    if (e->ends == NULL || e->first == NULL || e->faces == NULL || e->first_at == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n; k++) {
        const side_piece *p = &c->pieces[k];
        if (k == 0 || p->low != p[-1].low || p->high != p[-1].high) {
            e->first[e->n] = k;
            e->ends[e->n][0] = p->low;
            e->ends[e->n++][1] = p->high;
        }
        e->faces[k] = p->of;
    }
    e->first[e->n] = n;
    e->at = memory_allocate(2 * e->n + 1, sizeof *e->at, "edges of faces", error);
    if (e->at == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < e->n; k++)
        for (int end = 0; end < 2; end++) e->first_at[e->ends[k][end] + 2]++;
    for (size_t p = 0; p < e->n_places; p++) e->first_at[p + 2] += e->first_at[p + 1];
    for (size_t k = 0; k < e->n; k++)
        for (int end = 0; end < 2; end++) e->at[e->first_at[e->ends[k][end] + 1]++] = (uint32_t)k;
done:
    return status;
}

lam_status face_edges_find(const mesh *m, size_t n_faces, double slack, face_edges *out, lam_error *error) {
    lam_status status = LAM_OK;
    cutter c = {.m = m, .slack = slack};
    face_edges made = {.n_places = m->n_vertices};
    c.place = memory_allocate(m->n_vertices, sizeof *c.place, "edges of faces", error);
    if (c.place == NULL) TRY(LAM_ERR_MEMORY);
    TRY(weld(&c, error));
    for (uint32_t f = 0; f < n_faces; f++)
        for (size_t k = 0, corners = mesh_corners(m, f); k < corners; k++) {
            const uint32_t from = c.place[m->elements[f][k]], to = c.place[m->elements[f][(k + 1) % corners]];
            if (from != to) TRY(cut_side(&c, f, from, to, error));
        }
    array_sort(c.pieces, c.n_pieces, sizeof *c.pieces, by_ends);
    TRY(gather(&c, &made, error));
    made.place = c.place;
    c.place = NULL;
    *out = made;
    made = (face_edges){.n = 0};
done:
    place_grid_free(&c.grid);
    free(c.place);
    free(c.cuts);
    free(c.pieces);
    face_edges_free(&made);
    return status;
}

void face_edges_free(face_edges *e) {
    free(e->place);
    free(e->ends);
    free(e->first);
    free(e->faces);
    free(e->first_at);
    free(e->at);
    *e = (face_edges){.n = 0};
}
