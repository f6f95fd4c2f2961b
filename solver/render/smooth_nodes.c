/* Vertices at most 1e-6 (radius of the scene) apart are welded by a grid of points. Corners at one place
 * share a node where their elements have one group and n_i . n_j > cos 20 degrees. A node inside an edge from
 * a to b that belongs to one element alone is tied to it: its value is (1 - t) v_a + t v_b. */
#include "solver/render/smooth_nodes.h"

#include "solver/base/union_find.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The cosine of 20 degrees. */
#define SURFACE_COS 0.93969262

/* Each corner at a point is compared with at most this many previous ones. */
#define MANY_CORNERS 256

#define NONE 0xFFFFFFFFu

/* Points hashed by cubic cells; each cell is a chain. */
typedef struct point_grid {
    double cell;
    size_t n_heads; /* a power of 2 */
    uint32_t *heads, *next;
    const double (*points)[3];
} point_grid;

static int64_t grid_cell(const point_grid *g, double x) {
    return (int64_t)floor(fmin(fmax(x / g->cell, -4e18), 4e18));
}

static size_t grid_hash(const point_grid *g, const int64_t cell[3]) {
    uint64_t h = 0;
    for (int d = 0; d < 3; d++) {
        h = (h ^ (uint64_t)cell[d]) * 0x9E3779B97F4A7C15u;
        h ^= h >> 29;
    }
    return (size_t)h & (g->n_heads - 1);
}

static lam_status grid_create(const double (*points)[3], size_t n, double cell, point_grid *g,
                              lam_error *error) {
    *g = (point_grid){.cell = cell, .n_heads = 16, .points = points};
    while (g->n_heads < n) g->n_heads *= 2;
    g->heads = memory_allocate(g->n_heads, sizeof *g->heads, "smoothing", error);
    g->next = memory_allocate(n, sizeof *g->next, "smoothing", error);
    if (g->heads == NULL || g->next == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < g->n_heads; i++) g->heads[i] = NONE;
    return LAM_OK;
}

static void grid_free(point_grid *g) {
    free(g->heads);
    free(g->next);
}

static void grid_add(point_grid *g, uint32_t i) {
    const int64_t cell[3] = {grid_cell(g, g->points[i][0]), grid_cell(g, g->points[i][1]),
                             grid_cell(g, g->points[i][2])};
    const size_t head = grid_hash(g, cell);
    g->next[i] = g->heads[head];
    g->heads[head] = i;
}

/* Visits the points in the 27 cells around a point, and others with the same hash. */
static void grid_near(const point_grid *g, const double point[3], void (*visit)(void *context, uint32_t i),
                      void *context) {
    int64_t centre[3];
    for (int d = 0; d < 3; d++) centre[d] = grid_cell(g, point[d]);
    for (int k = 0; k < 27; k++) {
        const int64_t cell[3] = {centre[0] + k % 3 - 1, centre[1] + k / 3 % 3 - 1, centre[2] + k / 9 - 1};
        for (uint32_t i = g->heads[grid_hash(g, cell)]; i != NONE; i = g->next[i]) visit(context, i);
    }
}

/* An edge of an element between two nodes. */
typedef struct edge {
    uint64_t key; /* its nodes, the smaller first */
    uint32_t element;
    uint32_t corner; /* its first; the second is the next corner */
} edge;

typedef struct joining {
    const mesh *m;
    double tolerance; /* m */
    uint32_t *welded; /* [v]: the first vertex at this place */
    smooth_nodes *nodes;
} joining;

static bool same_surface(const mesh *m, uint32_t i, uint32_t j) {
    const float *a = m->normal[i], *b = m->normal[j];
    return m->group[i] == m->group[j] && (double)(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) > SURFACE_COS;
}

static double distance(const double a[3], const double b[3]) {
    return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) +
                (a[2] - b[2]) * (a[2] - b[2]));
}

typedef struct weld_query {
    const joining *s;
    const double *point;
    uint32_t found;
} weld_query;

static void weld_visit(void *context, uint32_t i) {
    weld_query *q = context;
    if (i < q->found && distance(q->s->m->vertices[i], q->point) <= q->s->tolerance) q->found = i;
}

static lam_status weld(joining *s, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = s->m;
    point_grid grid = {0};
    TRY(grid_create((const double(*)[3])m->vertices, m->n_vertices, 4 * s->tolerance, &grid, error));
    s->welded = memory_allocate(m->n_vertices, sizeof *s->welded, "smoothing", error);
    if (s->welded == NULL) TRY(LAM_ERR_MEMORY);
    for (uint32_t i = 0; i < m->n_vertices; i++) {
        weld_query q = {s, m->vertices[i], NONE};
        grid_near(&grid, m->vertices[i], weld_visit, &q);
        s->welded[i] = q.found == NONE ? i : q.found;
        if (q.found == NONE) grid_add(&grid, i);
    }
done:
    grid_free(&grid);
    return status;
}

/* One corner of an element and its welded vertex. */
typedef struct corner {
    uint32_t vertex, element, number;
} corner;

static int compare_corners(const void *left, const void *right) {
    const corner *a = left, *b = right;
    if (a->vertex != b->vertex) return a->vertex < b->vertex ? -1 : 1;
    if (a->element != b->element) return a->element < b->element ? -1 : 1;
    return (a->number > b->number) - (a->number < b->number);
}

/* Gives the corners at one place their nodes: one node for each surface. */
static void join_corners(joining *s, const corner *corners, uint32_t *parent, size_t count) {
    for (size_t i = 0; i < count; i++) parent[i] = (uint32_t)i;
    for (size_t i = 0; i < count; i++)
        for (size_t j = i > MANY_CORNERS ? i - MANY_CORNERS : 0; j < i; j++) {
            if (!same_surface(s->m, corners[i].element, corners[j].element)) continue;
            const uint32_t x = union_find_root(parent, (uint32_t)i), y = union_find_root(parent, (uint32_t)j);
            union_find_join(parent, x > y ? x : y, x > y ? y : x);
        }
    for (size_t i = 0; i < count; i++) {
        const uint32_t root = union_find_root(parent, (uint32_t)i);
        uint32_t *node = &s->nodes->corner[corners[i].element][corners[i].number];
        if (root == i) { /* the smallest of its set, so met first */
            s->nodes->vertex[s->nodes->n_nodes] = corners[i].vertex;
            s->nodes->element[s->nodes->n_nodes] = corners[i].element;
            *node = (uint32_t)s->nodes->n_nodes++;
        } else {
            *node = s->nodes->corner[corners[root].element][corners[root].number];
        }
    }
}

static lam_status make_nodes(joining *s, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = s->m;
    size_t count = 0;
    corner *corners = memory_allocate(m->n, 4 * sizeof *corners, "smoothing", error);
    uint32_t *parent = memory_allocate(m->n, 4 * sizeof *parent, "smoothing", error);
    s->nodes->corner = memory_allocate(m->n, sizeof *s->nodes->corner, "smoothing", error);
    s->nodes->vertex = memory_allocate(m->n, 4 * sizeof *s->nodes->vertex, "smoothing", error);
    s->nodes->element = memory_allocate(m->n, 4 * sizeof *s->nodes->element, "smoothing", error);
    if (corners == NULL || parent == NULL || s->nodes->corner == NULL || s->nodes->vertex == NULL ||
        s->nodes->element == NULL)
        TRY(LAM_ERR_MEMORY);
    for (uint32_t i = 0; i < m->n; i++)
        for (uint32_t k = 0; k < mesh_corners(m, i); k++)
            corners[count++] = (corner){s->welded[m->elements[i][k]], i, k};
    qsort(corners, count, sizeof *corners, compare_corners);
    for (size_t first = 0, last; first < count; first = last) {
        for (last = first + 1; last < count && corners[last].vertex == corners[first].vertex;) last++;
        join_corners(s, corners + first, parent, last - first);
    }
done:
    free(corners);
    free(parent);
    return status;
}

static int compare_edges(const void *left, const void *right) {
    const edge *a = left, *b = right;
    if (a->key != b->key) return a->key < b->key ? -1 : 1;
    if (a->element != b->element) return a->element < b->element ? -1 : 1;
    return (a->corner > b->corner) - (a->corner < b->corner);
}

static void edge_nodes(const joining *s, const edge *e, uint32_t *a, uint32_t *b) {
    *a = s->nodes->corner[e->element][e->corner];
    *b = s->nodes->corner[e->element][(e->corner + 1) % mesh_corners(s->m, e->element)];
}

/* The edges of only one element: boundaries, and edges that meet only a part of another one. *edges is freed
 * by the caller. */
static lam_status lone_edges(const joining *s, edge **edges, size_t *count, lam_error *error) {
    const mesh *m = s->m;
    size_t all = 0, kept = 0;
    edge *list = memory_allocate(m->n, 4 * sizeof *list, "smoothing", error);
    if (list == NULL) return LAM_ERR_MEMORY;
    for (uint32_t i = 0; i < m->n; i++)
        for (uint32_t k = 0; k < mesh_corners(m, i); k++) {
            edge e = {0, i, k};
            uint32_t a, b;
            edge_nodes(s, &e, &a, &b);
            e.key = a < b ? (uint64_t)a << 32 | b : (uint64_t)b << 32 | a;
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

typedef struct hang_query {
    joining *s;
    const edge *e;
    uint32_t a, b;
    const double *from, *to;
    double length;
} hang_query;

/* Constrains a node inside the edge to the values of its ends; the longest of several such edges wins. */
static void hang_visit(void *context, uint32_t node) {
    hang_query *q = context;
    joining *s = q->s;
    const double *point = s->m->vertices[s->nodes->vertex[node]];
    double along = 0, off = 0;
    if (node == q->a || node == q->b || s->nodes->ties[node].length >= q->length) return;
    for (int d = 0; d < 3; d++) along += (point[d] - q->from[d]) * (q->to[d] - q->from[d]);
    const double t = along / (q->length * q->length);
    if (t * q->length <= s->tolerance || (1 - t) * q->length <= s->tolerance) return;
    for (int d = 0; d < 3; d++) {
        const double apart = point[d] - (q->from[d] + t * (q->to[d] - q->from[d]));
        off += apart * apart;
    }
    if (off > s->tolerance * s->tolerance || !same_surface(s->m, s->nodes->element[node], q->e->element))
        return;
    s->nodes->ties[node] = (smooth_tie){q->a, q->b, q->e->element, t, q->length};
}

/* Finds the nodes inside edges by walking along each edge through a grid. */
static lam_status find_hanging(joining *s, const edge *edges, size_t count, lam_error *error) {
    lam_status status = LAM_OK;
    point_grid grid = {0};
    double total = 0, longest = 0;
    const size_t n_nodes = s->nodes->n_nodes;
    double(*points)[3] = memory_allocate(n_nodes, sizeof *points, "smoothing", error);
    bool *added = memory_allocate(n_nodes, sizeof *added, "smoothing", error);
    if (points == NULL || added == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t j = 0; j < n_nodes; j++)
        memcpy(points[j], s->m->vertices[s->nodes->vertex[j]], sizeof points[j]);
    for (size_t i = 0; i < count; i++) {
        uint32_t a, b;
        edge_nodes(s, &edges[i], &a, &b);
        total += distance(points[a], points[b]);
        longest = fmax(longest, distance(points[a], points[b]));
    }
    /* About one node per cell, and no edge through more than some thousand cells. */
    const double cell = fmax(fmax(total / (double)(count + 1), longest / 4096), 4 * s->tolerance);
    TRY(grid_create((const double(*)[3])points, n_nodes, cell, &grid, error));
    for (size_t i = 0; i < count; i++) {
        uint32_t ends[2];
        edge_nodes(s, &edges[i], &ends[0], &ends[1]);
        for (int k = 0; k < 2; k++) {
            if (!added[ends[k]]) grid_add(&grid, ends[k]);
            added[ends[k]] = true;
        }
    }
    for (size_t i = 0; i < count; i++) {
        hang_query q = {.s = s, .e = &edges[i]};
        edge_nodes(s, &edges[i], &q.a, &q.b);
        q.from = points[q.a];
        q.to = points[q.b];
        q.length = distance(q.from, q.to);
        const size_t steps = (size_t)(q.length / cell) + 1;
        if (!(q.length > s->tolerance)) continue;
        for (size_t step = 0; step <= steps; step++) {
            double place[3];
            const double t = (double)step / (double)steps;
            for (int d = 0; d < 3; d++) place[d] = q.from[d] + t * (q.to[d] - q.from[d]);
            grid_near(&grid, place, hang_visit, &q);
        }
    }
done:
    grid_free(&grid);
    free(points);
    free(added);
    return status;
}

lam_status smooth_nodes_create(const mesh *m, smooth_nodes *out, lam_error *error) {
    lam_status status = LAM_OK;
    smooth_nodes nodes = {0};
    joining s = {.m = m, .nodes = &nodes};
    edge *edges = NULL;
    size_t n_edges;
    double centre[3];
    mesh_bounds(m, centre, &s.tolerance);
    s.tolerance *= 1e-6;
    TRY(weld(&s, error));
    TRY(make_nodes(&s, error));
    TRY(lone_edges(&s, &edges, &n_edges, error));
    nodes.ties = memory_allocate(nodes.n_nodes, sizeof *nodes.ties, "smoothing", error);
    if (nodes.ties == NULL) TRY(LAM_ERR_MEMORY);
    TRY(find_hanging(&s, edges, n_edges, error));
    *out = nodes;
    nodes = (smooth_nodes){0};
done:
    smooth_nodes_free(&nodes);
    free(edges);
    free(s.welded);
    return status;
}

void smooth_nodes_free(smooth_nodes *nodes) {
    if (nodes == NULL) return;
    free(nodes->corner);
    free(nodes->vertex);
    free(nodes->element);
    free(nodes->ties);
    *nodes = (smooth_nodes){0};
}
