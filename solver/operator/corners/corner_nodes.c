/* Vertices at most 1e-6 (radius of the scene) apart are welded by a grid of points. Corners at one place
 * share a node where their elements have one group and n_i . n_j > cos 20 degrees. A node inside an edge from
 * a to b that belongs to one element alone is tied to it: its value is (1 - t) v_a + t v_b. */
#include "solver/operator/corners/corner_nodes.h"

#include "solver/base/union_find.h"
#include "solver/base/vector3.h"
#include "solver/operator/corners/corner_hanging.h"
#include "solver/operator/corners/point_grid.h"

#include <math.h>
#include <stdlib.h>

/* Each corner at a point is compared with at most this many previous ones. */
#define MANY_CORNERS 256

/* Half the diagonal of the bounding box. */
static double radius_of(const corner_mesh *m) {
    double square = 0;
    for (int d = 0; d < 3; d++) {
        double low = INFINITY, high = -INFINITY;
        for (size_t v = 0; v < m->n_vertices; v++) {
            low = fmin(low, m->vertices[v][d]);
            high = fmax(high, m->vertices[v][d]);
        }
        if (high > low) square += (high - low) * (high - low);
    }
    return sqrt(square) / 2;
}

typedef struct weld_query {
    const corner_draft *draft;
    const double *point;
    uint32_t found;
} weld_query;

static void weld_visit(void *context, uint32_t i) {
    weld_query *q = context;
    double apart[3];
    subtract3(q->draft->m->vertices[i], q->point, apart);
    if (i < q->found && dot3(apart, apart) <= q->draft->tolerance * q->draft->tolerance) q->found = i;
}

/* *welded [n_vertices]: the first vertex at each one's place; freed by the caller. */
static lam_status weld(const corner_draft *draft, uint32_t **welded, lam_error *error) {
    lam_status status = LAM_OK;
    const corner_mesh *m = draft->m;
    point_grid grid = {0};
    TRY(point_grid_create(m->vertices, m->n_vertices, 4 * draft->tolerance, &grid, error));
    *welded = memory_allocate(m->n_vertices, sizeof **welded, "corners", error);
    if (*welded == NULL) TRY(LAM_ERR_MEMORY);
    for (uint32_t i = 0; i < m->n_vertices; i++) {
        weld_query q = {draft, m->vertices[i], CORNER_NONE};
        point_grid_near(&grid, m->vertices[i], weld_visit, &q);
        (*welded)[i] = q.found == CORNER_NONE ? i : q.found;
        if (q.found == CORNER_NONE) point_grid_add(&grid, i);
    }
done:
    point_grid_free(&grid);
    return status;
}

/* One corner of an element and its welded vertex. */
typedef struct corner {
    uint32_t vertex, element, number;
} corner;

/* Lists corners by vertex, each vertex's by element: sorted by counting. */
static lam_status list_corners(const corner_mesh *m, const uint32_t *welded, corner **out, size_t *count,
                               lam_error *error) {
    lam_status status = LAM_OK;
    size_t *from = memory_allocate(m->n_vertices + 1, sizeof *from, "corners", error);
    corner *list = memory_allocate(m->n, 4 * sizeof *list, "corners", error);
    if (from == NULL || list == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < m->n; i++)
        for (size_t k = 0; k < corner_mesh_count(m, i); k++) from[welded[m->elements[i][k]] + 1]++;
    for (size_t v = 0; v < m->n_vertices; v++) from[v + 1] += from[v];
    *count = from[m->n_vertices];
    for (uint32_t i = 0; i < m->n; i++)
        for (uint32_t k = 0; k < corner_mesh_count(m, i); k++) {
            const uint32_t vertex = welded[m->elements[i][k]];
            list[from[vertex]++] = (corner){vertex, i, k};
        }
    *out = list;
    list = NULL;
done:
    free(from);
    free(list);
    return status;
}

/* Gives the corners at one place their nodes: one node for each surface. */
static void join_corners(corner_draft *draft, const corner *corners, uint32_t *parent, size_t count) {
    for (size_t i = 0; i < count; i++) parent[i] = (uint32_t)i;
    for (size_t i = 0; i < count; i++)
        for (size_t j = i > MANY_CORNERS ? i - MANY_CORNERS : 0; j < i; j++)
            if (corner_same_surface(draft->m, corners[i].element, corners[j].element))
                union_find_join(parent, (uint32_t)i, (uint32_t)j);
    for (size_t i = 0; i < count; i++) {
        const uint32_t root = union_find_root(parent, (uint32_t)i);
        uint32_t *node = &draft->corner[corners[i].element][corners[i].number];
        if (root == i) { /* the smallest of its set, so met first */
            draft->vertex[draft->n_nodes] = corners[i].vertex;
            draft->element[draft->n_nodes] = corners[i].element;
            *node = (uint32_t)draft->n_nodes++;
        } else {
            *node = draft->corner[corners[root].element][corners[root].number];
        }
    }
}

static void draft_free(corner_draft *draft) {
    free(draft->corner);
    free(draft->vertex);
    free(draft->element);
}

static lam_status make_draft(corner_draft *draft, lam_error *error) {
    lam_status status = LAM_OK;
    const corner_mesh *m = draft->m;
    size_t count = 0;
    corner *corners = NULL;
    uint32_t *welded = NULL, *parent = memory_allocate(m->n, 4 * sizeof *parent, "corners", error);
    draft->corner = memory_allocate(m->n, sizeof *draft->corner, "corners", error);
    draft->vertex = memory_allocate(m->n, 4 * sizeof *draft->vertex, "corners", error);
    draft->element = memory_allocate(m->n, 4 * sizeof *draft->element, "corners", error);
    if (parent == NULL || draft->corner == NULL || draft->vertex == NULL || draft->element == NULL)
        TRY(LAM_ERR_MEMORY);
    TRY(weld(draft, &welded, error));
    TRY(list_corners(m, welded, &corners, &count, error));
    for (size_t first = 0, last; first < count; first = last) {
        for (last = first + 1; last < count && corners[last].vertex == corners[first].vertex;) last++;
        join_corners(draft, corners + first, parent, last - first);
    }
done:
    free(corners);
    free(parent);
    free(welded);
    return status;
}

/* The nodes of a draft while they get their numbers. */
typedef struct numbering {
    const corner_draft *draft;
    const corner_inside *insides;
    size_t n_insides;
    uint32_t *number;  /* [n_nodes of the draft]: of each node, or CORNER_NONE */
    uint32_t *own;     /* [n_insides]: the number of the node there */
    corner_nodes *out; /* nodes made so far */
} numbering;

static uint32_t add_node(numbering *w, uint32_t vertex, uint32_t element) {
    corner_nodes *out = w->out;
    out->vertex[out->n_nodes] = vertex;
    out->element[out->n_nodes] = element;
    return (uint32_t)out->n_nodes++;
}

static uint32_t number_of(numbering *w, uint32_t node, uint32_t element) {
    if (w->number[node] == CORNER_NONE) w->number[node] = add_node(w, w->draft->vertex[node], element);
    return w->number[node];
}

/* The first of the insides of an element; they ascend by element. */
static size_t first_inside(const numbering *w, uint32_t element) {
    size_t low = 0, high = w->n_insides;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (w->insides[middle].element < element)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* Numbers the nodes of an element: its corners', and those inside its edges. */
static void number_element(numbering *w, uint32_t i) {
    const corner_mesh *m = w->draft->m;
    for (size_t k = 0; k < 4; k++)
        w->out->corner[i][k] =
            k < corner_mesh_count(m, i) ? number_of(w, w->draft->corner[i][k], i) : CORNER_NONE;
    for (size_t at = first_inside(w, i); at < w->n_insides && w->insides[at].element == i; at++) {
        const corner_inside *in = &w->insides[at];
        w->own[at] =
            in->node != CORNER_NONE ? number_of(w, in->node, i) : add_node(w, in->vertex, in->element);
    }
}

typedef struct place {
    uint32_t group, element;
} place;

static int compare_places(const void *left, const void *right) {
    const place *a = left, *b = right;
    if (a->group != b->group) return a->group < b->group ? -1 : 1;
    return (a->element > b->element) - (a->element < b->element);
}

static lam_status number_all(numbering *w, lam_error *error) {
    const corner_mesh *m = w->draft->m;
    place *order = memory_allocate(m->n, sizeof *order, "corners", error);
    bool ascends = true;
    if (order == NULL) return LAM_ERR_MEMORY;
    for (uint32_t i = 0; i < m->n; i++) {
        order[i] = (place){m->group[i], i};
        ascends = ascends && (i == 0 || m->group[i] >= m->group[i - 1]);
    }
    if (!ascends) qsort(order, m->n, sizeof *order, compare_places);
    for (size_t k = 0; k < m->n; k++) number_element(w, order[k].element);
    free(order);
    return LAM_OK;
}

/* The longest edge wins. */
static void set_ties(numbering *w) {
    for (size_t at = 0; at < w->n_insides; at++) {
        const corner_inside *in = &w->insides[at];
        const uint32_t *of = w->out->corner[in->element];
        corner_tie *tie = &w->out->ties[w->own[at]];
        if (in->length <= tie->length) continue;
        *tie = (corner_tie){of[in->edge], of[(in->edge + 1) % corner_mesh_count(w->draft->m, in->element)],
                            in->t, in->length};
    }
}

static void make_rings(numbering *w) {
    const corner_mesh *m = w->draft->m;
    corner_nodes *out = w->out;
    size_t at = 0, to = 0;
    for (uint32_t i = 0; i < m->n; i++) {
        out->ring_start[i] = to;
        for (uint32_t k = 0; k < corner_mesh_count(m, i); k++) {
            out->ring[to++] = out->corner[i][k];
            for (; at < w->n_insides && w->insides[at].element == i && w->insides[at].edge == k; at++) {
                out->inside[to] = true;
                out->ring[to++] = w->own[at];
            }
        }
    }
    out->ring_start[m->n] = to;
}

static lam_status make_nodes(numbering *w, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = w->draft->m->n, n_draft = w->draft->n_nodes, most = n_draft + w->n_insides;
    corner_nodes *out = w->out;
    w->number = memory_allocate(n_draft, sizeof *w->number, "corners", error);
    w->own = memory_allocate(w->n_insides, sizeof *w->own, "corners", error);
    out->corner = memory_allocate(n, sizeof *out->corner, "corners", error);
    out->vertex = memory_allocate(most, sizeof *out->vertex, "corners", error);
    out->element = memory_allocate(most, sizeof *out->element, "corners", error);
    out->ring_start = memory_allocate(n + 1, sizeof *out->ring_start, "corners", error);
    out->ring = memory_allocate(4 * n + w->n_insides, sizeof *out->ring, "corners", error);
    out->inside = memory_allocate(4 * n + w->n_insides, sizeof *out->inside, "corners", error);
    if (w->number == NULL || w->own == NULL || out->corner == NULL || out->vertex == NULL ||
        out->element == NULL || out->ring_start == NULL || out->ring == NULL || out->inside == NULL)
        TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n_draft; k++) w->number[k] = CORNER_NONE;
    TRY(number_all(w, error));
    out->ties = memory_allocate(out->n_nodes, sizeof *out->ties, "corners", error);
    if (out->ties == NULL) TRY(LAM_ERR_MEMORY);
    set_ties(w);
    make_rings(w);
done:
    free(w->number);
    free(w->own);
    return status;
}

lam_status corner_nodes_create(const corner_mesh *m, corner_nodes *out, lam_error *error) {
    lam_status status = LAM_OK;
    corner_nodes nodes = {0};
    corner_draft draft = {.m = m, .tolerance = 1e-6 * radius_of(m)};
    corner_inside *insides = NULL;
    size_t n_insides = 0;
    TRY(make_draft(&draft, error));
    TRY(corner_hanging_find(&draft, &insides, &n_insides, error));
    numbering w = {.draft = &draft, .insides = insides, .n_insides = n_insides, .out = &nodes};
    TRY(make_nodes(&w, error));
    *out = nodes;
    nodes = (corner_nodes){0};
done:
    corner_nodes_free(&nodes);
    draft_free(&draft);
    free(insides);
    return status;
}

void corner_nodes_free(corner_nodes *nodes) {
    if (nodes == NULL) return;
    free(nodes->corner);
    free(nodes->vertex);
    free(nodes->element);
    free(nodes->ties);
    free(nodes->ring_start);
    free(nodes->ring);
    free(nodes->inside);
    *nodes = (corner_nodes){0};
}
