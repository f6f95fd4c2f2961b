/* Elements a and b are joined at a side that they alone share in their plane, n_a . n_b >= 1 -
 * plane_same_direction and each within `flat` of the plane of the other. A part with a corner farther than
 * `flat` from its mean plane stays single elements; facet_outline.c cuts the others into pieces. */
#include "solver/scene/facet/facets.h"

#include "solver/base/array_sort.h"
#include "solver/base/union_find.h"
#include "solver/scene/facet/facet_outline.h"
#include "solver/scene/glass.h"
#include "solver/scene/plane.h"
#include "solver/scene/tables.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* At most this many sides between the same two places are compared pair by pair; more are not joined. */
enum { MEETING_MOST = 16 };

/* The side from corner `from` to corner `to` of an element, by its two places in ascending order. */
typedef struct edge {
    uint32_t low, high, element;
    bool forward, inner; /* from low to high; shared by two elements that were joined */
} edge;

typedef struct joining {
    const mesh *m;
    size_t n;
    double flat;
    uint32_t *place;  /* [n_vertices] */
    uint32_t *parent; /* [n] */
    uint32_t *part;   /* [n] */
    uint32_t *size;   /* [parts] */
    double (*normal)[3], *area;
    bool *alone; /* [parts] */
    edge *edges;
    side_list sides;
    size_t n_edges, n_parts;
} joining;

/* Orders edges that have one low place. */
static int edge_order(const void *a, const void *b) {
    const edge *p = a, *q = b;
    if (p->high != q->high) return p->high < q->high ? -1 : 1;
    return (p->element > q->element) - (p->element < q->element);
}

static int side_order(const void *a, const void *b) {
    const side *p = a, *q = b;
    if (p->part != q->part) return p->part < q->part ? -1 : 1;
    return (p->from > q->from) - (p->from < q->from);
}

/* The distance of an element's farthest corner from the plane through a point. */
static double off_plane(const mesh *m, size_t element, const double at[3], const double normal[3]) {
    double most = 0;
    for (size_t k = 0; k < mesh_corners(m, element); k++) {
        const double *v = m->vertices[m->elements[element][k]];
        double off = 0;
        for (int d = 0; d < 3; d++) off += normal[d] * (v[d] - at[d]);
        most = fmax(most, fabs(off));
    }
    return most;
}

/* Panes differ from group to group in what they pass: their elements are not joined with others. */
static bool of_one_pane(const mesh *m, uint32_t a, uint32_t b) {
    return m->glass == NULL || m->group[a] == m->group[b] || (!mesh_is_pane(m, a) && !mesh_is_pane(m, b));
}

static bool of_one_plane(const joining *j, uint32_t a, uint32_t b) {
    const mesh *m = j->m;
    const double p[3] = {m->normal[a][0], m->normal[a][1], m->normal[a][2]};
    const double q[3] = {m->normal[b][0], m->normal[b][1], m->normal[b][2]};
    return of_one_pane(m, a, b) && p[0] * q[0] + p[1] * q[1] + p[2] * q[2] >= 1 - plane_same_direction &&
           off_plane(m, b, m->vertices[m->elements[a][0]], p) <= j->flat &&
           off_plane(m, a, m->vertices[m->elements[b][0]], q) <= j->flat;
}

/* Joins elements of one plane across the sides e[0] ... e[count-1] between the same two places, where exactly
 * two of them match. */
static void join_meeting(joining *j, edge *e, size_t count) {
    if (count > MEETING_MOST) return;
    for (size_t k = 0; k < count; k++) {
        size_t mate = count, mates = 0;
        for (size_t l = 0; l < count; l++)
            if (e[l].forward != e[k].forward && of_one_plane(j, e[k].element, e[l].element))
                mate = l, mates++;
        if (mates != 1 || mate < k) continue;
        size_t back = 0;
        for (size_t l = 0; l < count; l++)
            back += e[l].forward == e[k].forward && of_one_plane(j, e[mate].element, e[l].element);
        if (back != 1) continue;
        e[k].inner = e[mate].inner = true;
        union_find_join(j->parent, e[k].element, e[mate].element);
    }
}

/* Edges of one low place up to which insertion is quicker: all but those of the middle of a fan. */
enum { FEW_EDGES = 24 };

static void sort_of_place(edge *edges, size_t count) {
    if (count > FEW_EDGES) {
        array_sort(edges, count, sizeof *edges, edge_order);
        return;
    }
    for (size_t k = 1; k < count; k++) {
        const edge one = edges[k];
        size_t at = k;
        for (; at > 0 && edge_order(&one, &edges[at - 1]) < 0; at--) edges[at] = edges[at - 1];
        edges[at] = one;
    }
}

/* Sorts edges by their places, then by their elements. */
static lam_status sort_edges(joining *j, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = j->m->n_vertices;
    edge *sorted = memory_allocate(j->n_edges, sizeof *sorted, "facets", error);
    size_t *from = memory_allocate(n + 1, sizeof *from, "facets", error);
    if (sorted == NULL || from == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < j->n_edges; k++) from[j->edges[k].low + 1]++;
    for (size_t v = 0; v < n; v++) from[v + 1] += from[v];
    for (size_t k = 0; k < j->n_edges; k++) {
        const edge *e = &j->edges[k];
        sorted[from[e->low]++] = *e;
    }
    for (size_t v = 0, first = 0; v < n; first = from[v++]) sort_of_place(sorted + first, from[v] - first);
    memcpy(j->edges, sorted, j->n_edges * sizeof *sorted);
done:
    free(sorted);
    free(from);
    return status;
}

static lam_status join_neighbours(joining *j, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = j->m;
    for (uint32_t i = 0; i < j->n; i++) {
        const size_t corners = mesh_corners(m, i);
        j->parent[i] = i;
        for (size_t k = 0; k < corners; k++) {
            const uint32_t from = j->place[m->elements[i][k]],
                           to = j->place[m->elements[i][(k + 1) % corners]];
            j->edges[j->n_edges++] =
                (edge){from < to ? from : to, from < to ? to : from, i, from < to, false};
        }
    }
    TRY(sort_edges(j, error));
    for (size_t first = 0, last; first < j->n_edges; first = last) {
        const edge *e = &j->edges[first];
        for (last = first + 1;
             last < j->n_edges && j->edges[last].low == e->low && j->edges[last].high == e->high; last++) {
        }
        join_meeting(j, &j->edges[first], last - first);
    }
done:
    return status;
}

/* Numbers the parts by their first elements and measures them. A part is alone where it is one element or, as
 * a whole, not plane. */
static lam_status measure_parts(joining *j, lam_error *error) {
    const mesh *m = j->m;
    for (size_t i = 0; i < j->n; i++) j->part[i] = MESH_NO_VERTEX;
    for (uint32_t i = 0; i < j->n; i++) {
        const uint32_t root = union_find_root(j->parent, i);
        if (j->part[root] == MESH_NO_VERTEX) j->part[root] = (uint32_t)j->n_parts++;
        j->part[i] = j->part[root];
    }
    j->size = memory_allocate(j->n_parts, sizeof *j->size, "facets", error);
    j->normal = memory_allocate(j->n_parts, sizeof *j->normal, "facets", error);
    j->area = memory_allocate(j->n_parts, sizeof *j->area, "facets", error);
    j->alone = memory_allocate(j->n_parts, sizeof *j->alone, "facets", error);
    double(*centre)[3] = memory_allocate(j->n_parts, sizeof *centre, "facets", error);
    if (j->size == NULL || j->normal == NULL || j->area == NULL || j->alone == NULL || centre == NULL) {
        free(centre);
        return LAM_ERR_MEMORY;
    }
    for (size_t i = 0; i < j->n; i++) {
        const uint32_t part = j->part[i];
        double at[3];
        mesh_centroid(m, i, at);
        j->size[part]++;
        j->area[part] += m->area[i];
        for (int d = 0; d < 3; d++) {
            centre[part][d] += m->area[i] * at[d];
            j->normal[part][d] += m->area[i] * (double)m->normal[i][d];
        }
    }
    for (size_t part = 0; part < j->n_parts; part++) {
        double *n = j->normal[part];
        const double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (int d = 0; d < 3; d++) {
            n[d] /= length;
            centre[part][d] /= j->area[part];
        }
        j->alone[part] = j->size[part] == 1;
    }
    for (size_t i = 0; i < j->n; i++)
        if (off_plane(m, i, centre[j->part[i]], j->normal[j->part[i]]) > j->flat) j->alone[j->part[i]] = true;
    free(centre);
    return LAM_OK;
}

/* The sides that bound the parts. */
static lam_status find_sides(joining *j, lam_error *error) {
    j->sides.capacity = j->n_edges;
    j->sides.sides = memory_allocate(j->n_edges, sizeof *j->sides.sides, "facets", error);
    if (j->sides.sides == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < j->n_edges; k++) {
        const edge *e = &j->edges[k];
        if (e->inner || j->alone[j->part[e->element]]) continue;
        j->sides.sides[j->sides.n++] = (side){.from = e->forward ? e->low : e->high,
                                              .to = e->forward ? e->high : e->low,
                                              .part = j->part[e->element]};
    }
    array_sort(j->sides.sides, j->sides.n, sizeof *j->sides.sides, side_order);
    return sides_cancel(j->m, j->flat, &j->sides, error);
}

static lam_status reserve(size_t n_elements, size_t n, size_t n_pieces, facets *f, lam_error *error) {
    f->n = n;
    f->of_element = memory_allocate(n_elements, sizeof *f->of_element, "facets", error);
    f->elements = memory_allocate(n_elements, sizeof *f->elements, "facets", error);
    f->first = memory_allocate(n + 1, sizeof *f->first, "facets", error);
    f->normal = memory_allocate(n, sizeof *f->normal, "facets", error);
    f->pieces = memory_allocate(n_pieces, sizeof *f->pieces, "facets", error);
    f->piece_facet = memory_allocate(n_pieces, sizeof *f->piece_facet, "facets", error);
    return f->of_element == NULL || f->elements == NULL || f->first == NULL || f->normal == NULL ||
                   f->pieces == NULL || f->piece_facet == NULL
               ? LAM_ERR_MEMORY
               : LAM_OK;
}

/* Turns parts into facets: one for each part, or one for each element of a part that is alone. */
static lam_status fill(const joining *j, const outlines *o, facets *f, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = j->m;
    uint32_t *facet_of = memory_allocate(j->n_parts, sizeof *facet_of, "facets", error);
    size_t singles = 0, joined = 0;
    for (size_t i = 0; i < j->n; i++) singles += o->alone[j->part[i]];
    for (size_t part = 0; part < j->n_parts; part++) joined += !o->alone[part];
    if (facet_of == NULL) return LAM_ERR_MEMORY;
    TRY(reserve(j->n, singles + joined, singles + o->n_pieces, f, error));
    uint32_t next = 0;
    for (size_t part = 0; part < j->n_parts; part++) facet_of[part] = MESH_NO_VERTEX;
    for (size_t i = 0; i < j->n; i++) {
        const uint32_t part = j->part[i];
        const bool alone = o->alone[part], known = !alone && facet_of[part] != MESH_NO_VERTEX;
        const uint32_t facet = known ? facet_of[part] : next++;
        f->of_element[i] = facet;
        f->first[facet + 1]++;
        if (known) continue;
        facet_of[part] = facet;
        for (int d = 0; d < 3; d++) f->normal[facet][d] = alone ? m->normal[i][d] : (float)j->normal[part][d];
        if (!alone) continue;
        memcpy(f->pieces[f->n_pieces], m->elements[i], sizeof *f->pieces);
        f->piece_facet[f->n_pieces++] = facet;
    }
    for (size_t p = 0; p < o->n_pieces; p++) {
        memcpy(f->pieces[f->n_pieces], o->pieces[p], sizeof *f->pieces);
        f->piece_facet[f->n_pieces++] = facet_of[o->piece_part[p]];
    }
    for (size_t k = 0; k < f->n; k++) f->first[k + 1] += f->first[k];
    for (size_t i = j->n; i-- > 0;) f->elements[--f->first[f->of_element[i] + 1]] = (uint32_t)i;
    for (size_t k = 0; k < f->n; k++) f->first[k] = f->first[k + 1];
    f->first[f->n] = (uint32_t)j->n;
done:
    free(facet_of);
    return status;
}

lam_status facets_join(const mesh *m, size_t n_elements, double flat, facets *out, lam_error *error) {
    lam_status status = LAM_OK;
    joining j = {.m = m, .n = n_elements, .flat = flat};
    outlines o = {.m = m};
    *out = (facets){.n = 0};
    j.place = memory_allocate(m->n_vertices, sizeof *j.place, "facets", error);
    j.parent = memory_allocate(j.n, sizeof *j.parent, "facets", error);
    j.part = memory_allocate(j.n, sizeof *j.part, "facets", error);
    j.edges = memory_allocate(j.n, 4 * sizeof *j.edges, "facets", error);
    if (j.place == NULL || j.parent == NULL || j.part == NULL || j.edges == NULL) TRY(LAM_ERR_MEMORY);
    TRY(points_weld(m->n_vertices, (const double(*)[3])m->vertices, j.place, error));
    TRY(join_neighbours(&j, error));
    TRY(measure_parts(&j, error));
    TRY(find_sides(&j, error));
    o = (outlines){.m = m,
                   .n_elements = j.n,
                   .place = j.place,
                   .flat = flat,
                   .n_parts = j.n_parts,
                   .part = j.part,
                   .size = j.size,
                   .normal = (const double(*)[3])j.normal,
                   .area = j.area,
                   .alone = j.alone,
                   .sides = j.sides.sides,
                   .n_sides = j.sides.n};
    TRY(outlines_cut(&o, error));
    TRY(fill(&j, &o, out, error));
done:
    free(j.place);
    free(j.parent);
    free(j.part);
    free(j.size);
    free(j.normal);
    free(j.area);
    free(j.alone);
    free(j.edges);
    free(j.sides.sides);
    free(o.pieces);
    free(o.piece_part);
    if (status != LAM_OK) facets_free(out);
    return status;
}

lam_status facets_alone(const mesh *m, size_t n_elements, facets *out, lam_error *error) {
    lam_status status = LAM_OK;
    *out = (facets){.n = 0};
    TRY(reserve(n_elements, n_elements, n_elements, out, error));
    for (uint32_t i = 0; i < n_elements; i++)
        out->of_element[i] = out->elements[i] = out->first[i] = out->piece_facet[i] = i;
    out->first[n_elements] = (uint32_t)n_elements;
    out->n_pieces = n_elements;
    memcpy(out->normal, m->normal, n_elements * sizeof *out->normal);
    memcpy(out->pieces, m->elements, n_elements * sizeof *out->pieces);
done:
    if (status != LAM_OK) facets_free(out);
    return status;
}

void facets_free(facets *f) {
    free(f->of_element);
    free(f->first);
    free(f->elements);
    free(f->normal);
    free(f->pieces);
    free(f->piece_facet);
    *f = (facets){.n = 0};
}
