#include "solver/operator/corners/corner_hanging.h"

#include "solver/base/array_grow.h"
#include "solver/base/vector3.h"
#include "solver/operator/corners/point_grid.h"

#include <math.h>
#include <stdlib.h>

/* An edge of an element between two nodes. */
typedef struct edge {
    uint64_t key; /* its nodes, the smaller first */
    uint32_t element;
    uint32_t corner; /* its first; the second is the next corner */
} edge;

static int compare_edges(const void *left, const void *right) {
    const edge *a = left, *b = right;
    if (a->key != b->key) return a->key < b->key ? -1 : 1;
    if (a->element != b->element) return a->element < b->element ? -1 : 1;
    return (a->corner > b->corner) - (a->corner < b->corner);
}

static void edge_nodes(const corner_draft *d, const edge *e, uint32_t nodes[2]) {
    nodes[0] = d->corner[e->element][e->corner];
    nodes[1] = d->corner[e->element][(e->corner + 1) % corner_mesh_count(d->m, e->element)];
}

/* The edges of only one element: boundaries, and edges that meet only a part of another one. *edges is freed
 * by the caller. */
static lam_status lone_edges(const corner_draft *d, edge **edges, size_t *count, lam_error *error) {
    const corner_mesh *m = d->m;
    size_t all = 0, kept = 0;
    edge *list = memory_allocate(m->n, 4 * sizeof *list, "corners", error);
    if (list == NULL) return LAM_ERR_MEMORY;
    for (uint32_t i = 0; i < m->n; i++)
        for (uint32_t k = 0; k < corner_mesh_count(m, i); k++) {
            edge e = {0, i, k};
            uint32_t ends[2];
            edge_nodes(d, &e, ends);
            e.key = ends[0] < ends[1] ? (uint64_t)ends[0] << 32 | ends[1] : (uint64_t)ends[1] << 32 | ends[0];
            list[all++] = e;
        }
    qsort(list, all, sizeof *list, compare_edges);
    for (size_t first = 0, last; first < all; first = last) {
        for (last = first + 1; last < all && list[last].key == list[first].key;) last++;
        if (last == first + 1) list[kept++] = list[first];
    }
    *edges = list;
    *count = kept;
    return LAM_OK;
}

static double distance(const double a[3], const double b[3]) {
    double apart[3];
    subtract3(a, b, apart);
    return sqrt(dot3(apart, apart));
}

typedef struct hang_query {
    const corner_draft *d;
    const edge *e;
    uint32_t number; /* of the edge, from 1 */
    uint32_t *seen;  /* [n_vertices]: the last edge that met them */
    uint32_t from, to;
    double length;
    corner_inside *found;
    size_t count, capacity, most;
    lam_error *error;
    lam_status status;
} hang_query;

/* The node of the edge's surface at a vertex. Nodes ascend by vertex. */
static uint32_t own_node(const corner_draft *d, uint32_t vertex, uint32_t element) {
    size_t low = 0, high = d->n_nodes;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (d->vertex[middle] < vertex)
            low = middle + 1;
        else
            high = middle;
    }
    for (; low < d->n_nodes && d->vertex[low] == vertex; low++)
        if (corner_same_surface(d->m, d->element[low], element)) return (uint32_t)low;
    return CORNER_NONE;
}

/* Adds a vertex that is inside the edge. */
static void hang_visit(void *context, uint32_t vertex) {
    hang_query *q = context;
    const corner_mesh *m = q->d->m;
    double along[3], apart[3];
    if (q->seen[vertex] == q->number || q->status != LAM_OK || q->count == q->most) return;
    subtract3(m->vertices[q->to], m->vertices[q->from], along);
    subtract3(m->vertices[vertex], m->vertices[q->from], apart);
    const double t = dot3(apart, along) / (q->length * q->length), tolerance = q->d->tolerance;
    if (!(t * q->length > tolerance && (1 - t) * q->length > tolerance)) return;
    for (int d = 0; d < 3; d++) apart[d] -= t * along[d];
    if (dot3(apart, apart) > tolerance * tolerance) return;
    q->seen[vertex] = q->number;
    if (q->count == q->capacity) {
        const size_t more = array_capacity(q->capacity, q->count + 1);
        q->status = array_resize(&q->found, more, sizeof *q->found, "corners", q->error);
        if (q->status != LAM_OK) return;
        q->capacity = more;
    }
    q->found[q->count++] = (corner_inside){.element = q->e->element,
                                           .edge = q->e->corner,
                                           .vertex = vertex,
                                           .node = own_node(q->d, vertex, q->e->element),
                                           .t = t,
                                           .length = q->length};
}

static int compare_insides(const void *left, const void *right) {
    const corner_inside *a = left, *b = right;
    if (a->element != b->element) return a->element < b->element ? -1 : 1;
    if (a->edge != b->edge) return a->edge < b->edge ? -1 : 1;
    if (a->t != b->t) return a->t < b->t ? -1 : 1;
    return (a->vertex > b->vertex) - (a->vertex < b->vertex);
}

/* Walks along an edge through a grid of the ends of all. */
static void walk(hang_query *q, const point_grid *grid) {
    const double *from = q->d->m->vertices[q->from], *to = q->d->m->vertices[q->to];
    if (!(q->length > q->d->tolerance)) return;
    const size_t steps = (size_t)fmin(q->length / grid->cell, 4096) + 1;
    for (size_t step = 0; step <= steps; step++) {
        double place[3];
        const double t = (double)step / (double)steps;
        for (int d = 0; d < 3; d++) place[d] = from[d] + t * (to[d] - from[d]);
        point_grid_near(grid, place, hang_visit, q);
    }
}

lam_status corner_hanging_find(const corner_draft *draft, corner_inside **out, size_t *count,
                               lam_error *error) {
    lam_status status = LAM_OK;
    const corner_mesh *m = draft->m;
    point_grid grid = {0};
    edge *edges = NULL;
    size_t n_edges = 0;
    double total = 0, longest = 0;
    hang_query q = {.d = draft, .error = error, .most = INSIDE_MOST * m->n};
    TRY(lone_edges(draft, &edges, &n_edges, error));
    q.seen = memory_allocate(m->n_vertices, sizeof *q.seen, "corners", error);
    if (q.seen == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n_edges; i++) {
        uint32_t ends[2];
        edge_nodes(draft, &edges[i], ends);
        const double length =
            distance(m->vertices[draft->vertex[ends[0]]], m->vertices[draft->vertex[ends[1]]]);
        total += length;
        longest = fmax(longest, length);
    }
    /* About one node per cell, and no edge through more than some thousand cells. */
    const double cell = fmax(fmax(total / (double)(n_edges + 1), longest / 4096), 4 * draft->tolerance);
    TRY(point_grid_create(m->vertices, m->n_vertices, cell, &grid, error));
    for (size_t i = 0; i < n_edges; i++) {
        uint32_t ends[2];
        edge_nodes(draft, &edges[i], ends);
        for (int k = 0; k < 2; k++) {
            const uint32_t vertex = draft->vertex[ends[k]];
            if (q.seen[vertex] == 0) point_grid_add(&grid, vertex);
            q.seen[vertex] = CORNER_NONE;
        }
    }
    for (size_t i = 0; i < n_edges; i++) {
        uint32_t ends[2];
        edge_nodes(draft, &edges[i], ends);
        q.e = &edges[i];
        q.number = (uint32_t)i + 1;
        q.from = draft->vertex[ends[0]];
        q.to = draft->vertex[ends[1]];
        q.length = distance(m->vertices[q.from], m->vertices[q.to]);
        walk(&q, &grid);
        TRY(q.status);
    }
    if (q.count > 0) qsort(q.found, q.count, sizeof *q.found, compare_insides);
    *out = q.found;
    *count = q.count;
    q.found = NULL;
done:
    point_grid_free(&grid);
    free(edges);
    free(q.seen);
    free(q.found);
    return status;
}
