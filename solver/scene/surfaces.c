#include "solver/scene/surfaces.h"

#include "solver/base/union_find.h"

#include <math.h>
#include <stdlib.h>

/* cos 30 degrees */
#define SURFACE_COS 0.8660254

/* Each element at a place is compared with at most this many previous ones. */
#define MANY_CORNERS 64

#define NONE 0xFFFFFFFFu

/* A vertex as a cell of a grid so fine that the vertices of a cell are one place. */
typedef struct place {
    int64_t cell[3];
    uint32_t vertex;
} place;

typedef struct corner {
    uint32_t place, element;
} corner;

static int place_order(const void *a, const void *b) {
    const place *p = a, *q = b;
    for (int d = 0; d < 3; d++)
        if (p->cell[d] != q->cell[d]) return p->cell[d] < q->cell[d] ? -1 : 1;
    return (p->vertex > q->vertex) - (p->vertex < q->vertex);
}

static int corner_order(const void *a, const void *b) {
    const corner *p = a, *q = b;
    if (p->place != q->place) return p->place < q->place ? -1 : 1;
    return (p->element > q->element) - (p->element < q->element);
}

lam_status mesh_places(const mesh *m, uint32_t *places, lam_error *error) {
    place *sorted = memory_allocate(m->n_vertices, sizeof *sorted, "surfaces", error);
    double centre[3], radius;
    if (sorted == NULL) return LAM_ERR_MEMORY;
    mesh_bounds(m, centre, &radius);
    const double cell = radius > 0 ? 2e-6 * radius : 1;
    for (uint32_t v = 0; v < m->n_vertices; v++) {
        sorted[v].vertex = v;
        for (int d = 0; d < 3; d++)
            sorted[v].cell[d] =
                (int64_t)llround(fmin(fmax((m->vertices[v][d] - centre[d]) / cell, -4e18), 4e18));
    }
    qsort(sorted, m->n_vertices, sizeof *sorted, place_order);
    uint32_t number = 0;
    for (size_t k = 0; k < m->n_vertices; k++) {
        const int64_t *here = sorted[k].cell, *before = sorted[k > 0 ? k - 1 : 0].cell;
        if (k > 0 && (here[0] != before[0] || here[1] != before[1] || here[2] != before[2])) number++;
        places[sorted[k].vertex] = number;
    }
    free(sorted);
    return LAM_OK;
}

static bool face_alike(const mesh *m, uint32_t i, uint32_t j) {
    const float *a = m->normal[i], *b = m->normal[j];
    return (double)(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) > SURFACE_COS;
}

lam_status mesh_surfaces(const mesh *m, uint32_t *surface, size_t *n_surfaces, lam_error *error) {
    lam_status status = LAM_OK;
    uint32_t *places = memory_allocate(m->n_vertices, sizeof *places, "surfaces", error), *parent = NULL;
    corner *corners = memory_allocate(m->n, 4 * sizeof *corners, "surfaces", error);
    size_t n_corners = 0, count = 0;
    parent = memory_allocate(m->n, sizeof *parent, "surfaces", error);
    if (places == NULL || corners == NULL || parent == NULL) TRY(LAM_ERR_MEMORY);
    TRY(mesh_places(m, places, error));
    for (uint32_t i = 0; i < m->n; i++) {
        for (size_t k = 0; k < mesh_corners(m, i); k++)
            corners[n_corners++] = (corner){places[m->elements[i][k]], i};
        parent[i] = i;
    }
    qsort(corners, n_corners, sizeof *corners, corner_order);
    for (size_t first = 0, k = 0; k < n_corners; k++) {
        if (corners[k].place != corners[first].place) first = k;
        const uint32_t i = corners[k].element;
        for (size_t l = k - first > MANY_CORNERS ? k - MANY_CORNERS : first; l < k; l++)
            if (face_alike(m, i, corners[l].element)) union_find_join(parent, i, corners[l].element);
    }
    for (size_t i = 0; i < m->n; i++) surface[i] = NONE;
    for (uint32_t i = 0; i < m->n; i++) { /* the root's entry holds the number until its own turn */
        const uint32_t root = union_find_root(parent, i);
        if (surface[root] == NONE) surface[root] = (uint32_t)count++;
        surface[i] = surface[root];
    }
    *n_surfaces = count;
done:
    free(places);
    free(corners);
    free(parent);
    return status;
}
