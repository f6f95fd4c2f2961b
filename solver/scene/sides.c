#include "solver/scene/sides.h"

#include "solver/base/array_sort.h"
#include "solver/scene/surfaces.h"

#include <stdlib.h>

#define NONE 0xFFFFFFFFu

/* An edge between two places, low < high, of an element that runs along it upwards or downwards. */
typedef struct edge {
    uint32_t low, high, element;
    bool downwards;
} edge;

static int edge_order(const void *a, const void *b) {
    const edge *p = a, *q = b;
    if (p->low != q->low) return p->low < q->low ? -1 : 1;
    if (p->high != q->high) return p->high < q->high ? -1 : 1;
    return (p->element > q->element) - (p->element < q->element);
}

/* Disjoint sets whose members know whether they lie as their parent does. */
typedef struct sided_forest {
    uint32_t *parent;
    bool *differs; /* from its parent */
} sided_forest;

/* The representative of i; *differs: i lies otherwise. */
static uint32_t root_of(sided_forest *f, uint32_t i, bool *differs) {
    *differs = false;
    while (f->parent[i] != i) {
        const uint32_t above = f->parent[i];
        f->differs[i] = f->differs[i] != f->differs[above]; /* a root differs from itself in nothing */
        f->parent[i] = f->parent[above];
        *differs = *differs != f->differs[i];
        i = f->parent[i];
    }
    return i;
}

static void join(sided_forest *f, uint32_t i, uint32_t j, bool differ) {
    bool i_differs, j_differs;
    const uint32_t a = root_of(f, i, &i_differs), b = root_of(f, j, &j_differs);
    if (a == b) return;
    f->parent[a] = b;
    f->differs[a] = (i_differs != j_differs) != differ;
}

/* All edges between different places, sorted; *n_edges. */
static lam_status sorted_edges(const mesh *m, edge **out, size_t *n_edges, lam_error *error) {
    lam_status status = LAM_OK;
    size_t n = 0;
    edge *edges = memory_allocate(m->n, 4 * sizeof *edges, "edges", error);
    uint32_t *places = memory_allocate(m->n_vertices, sizeof *places, "edges", error);
    if (edges == NULL || places == NULL) TRY(LAM_ERR_MEMORY);
    TRY(mesh_places(m, places, error));
    for (uint32_t i = 0; i < m->n; i++) {
        const size_t corners = mesh_corners(m, i);
        for (size_t k = 0; k < corners; k++) {
            const uint32_t from = places[m->elements[i][k]], to = places[m->elements[i][(k + 1) % corners]];
            if (from < to) edges[n++] = (edge){from, to, i, false};
            if (from > to) edges[n++] = (edge){to, from, i, true};
        }
    }
    array_sort(edges, n, sizeof *edges, edge_order);
    *out = edges;
    *n_edges = n;
    edges = NULL;
done:
    free(edges);
    free(places);
    return status;
}

/* Numbers the patches, and turns the less of each. */
static lam_status settle(const mesh *m, sided_forest *f, mesh_sides *s, lam_error *error) {
    double *differing =
        memory_allocate(m->n, sizeof *differing, "sides", error); /* area, less that which does not */
    if (differing == NULL) return LAM_ERR_MEMORY;
    for (uint32_t i = 0; i < m->n; i++) s->patch[i] = NONE;
    for (uint32_t i = 0; i < m->n; i++) { /* the root's entry holds the number until its own turn */
        const uint32_t root = root_of(f, i, &s->turned[i]);
        if (s->patch[root] == NONE) s->patch[root] = (uint32_t)s->n_patches++;
        s->patch[i] = s->patch[root];
        differing[s->patch[i]] += s->turned[i] ? m->area[i] : -m->area[i];
    }
    for (size_t i = 0; i < m->n; i++)
        if (differing[s->patch[i]] > 0) s->turned[i] = !s->turned[i];
    free(differing);
    return LAM_OK;
}

lam_status mesh_sides_find(const mesh *m, mesh_sides *out, lam_error *error) {
    lam_status status = LAM_OK;
    mesh_sides s = {.n_patches = 0};
    sided_forest f = {NULL, NULL};
    edge *edges = NULL;
    size_t n_edges = 0;
    s.patch = memory_allocate(m->n, sizeof *s.patch, "sides", error);
    s.turned = memory_allocate(m->n, sizeof *s.turned, "sides", error);
    f.parent = memory_allocate(m->n, sizeof *f.parent, "sides", error);
    f.differs = memory_allocate(m->n, sizeof *f.differs, "sides", error);
    if (s.patch == NULL || s.turned == NULL || f.parent == NULL || f.differs == NULL) TRY(LAM_ERR_MEMORY);
    for (uint32_t i = 0; i < m->n; i++) f.parent[i] = i;
    TRY(sorted_edges(m, &edges, &n_edges, error));
    for (size_t first = 0, next; first < n_edges; first = next) {
        for (next = first + 1; next < n_edges; next++)
            if (edges[next].low != edges[first].low || edges[next].high != edges[first].high) break;
        const edge *e = edges + first;
        if (next - first == 2 && e[0].element != e[1].element)
            join(&f, e[0].element, e[1].element, e[0].downwards == e[1].downwards);
    }
    TRY(settle(m, &f, &s, error));
    *out = s;
    s = (mesh_sides){.n_patches = 0};
done:
    mesh_sides_free(&s);
    free(f.parent);
    free(f.differs);
    free(edges);
    return status;
}

void mesh_sides_free(mesh_sides *s) {
    free(s->patch);
    free(s->turned);
    *s = (mesh_sides){.n_patches = 0};
}

void mesh_turn(mesh *m, size_t element) {
    uint32_t *e = m->elements[element];
    const size_t last = mesh_corners(m, element) - 1;
    const uint32_t second = e[1];
    e[1] = e[last];
    e[last] = second;
    for (int d = 0; d < 3; d++) m->normal[element][d] = -m->normal[element][d];
}
