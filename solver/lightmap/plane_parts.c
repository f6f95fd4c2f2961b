#include "solver/lightmap/plane_parts.h"

#include "solver/base/array_sort.h"
#include "solver/base/union_find.h"
#include "solver/base/vector3.h"
#include "solver/scene/plane.h"
#include "solver/scene/tables.h"

#include <math.h>
#include <stdlib.h>

static const char what[] = "a lightmap";

/* A side of an element, between two places. */
typedef struct part_edge {
    uint32_t low, high, element;
} part_edge;

static int compare_edges(const void *a, const void *b) {
    const part_edge *p = a, *q = b;
    if (p->low != q->low) return p->low < q->low ? -1 : 1;
    if (p->high != q->high) return p->high < q->high ? -1 : 1;
    return p->element < q->element ? -1 : p->element > q->element;
}

static double cosine_of(const mesh *m, uint32_t i, uint32_t j) {
    double sum = 0;
    for (int d = 0; d < 3; d++) sum += (double)m->normal[i][d] * (double)m->normal[j][d];
    return sum;
}

/* The distance of the farthest corner of element j from the plane of element i. */
static double off_plane(const mesh *m, uint32_t i, uint32_t j) {
    double normal[3], most = 0;
    for (int d = 0; d < 3; d++) normal[d] = (double)m->normal[i][d];
    for (size_t k = 0; k < mesh_corners(m, j); k++) {
        double way[3];
        subtract3(m->vertices[m->elements[j][k]], m->vertices[m->elements[i][0]], way);
        most = fmax(most, fabs(dot3(way, normal)));
    }
    return most;
}

/* Joins elements that share an edge and lie in one plane, within flat metres. */
static lam_status join_by_edges(const mesh *m, double flat, uint32_t *parent, lam_error *error) {
    lam_status status = LAM_OK;
    size_t n = 0;
    uint32_t *place = memory_allocate(m->n_vertices, sizeof *place, what, error);
    part_edge *edges = memory_allocate(m->n, 4 * sizeof *edges, what, error);
    if (place == NULL || edges == NULL) TRY(LAM_ERR_MEMORY);
    TRY(points_weld(m->n_vertices, (const double(*)[3])m->vertices, place, error));
    for (uint32_t i = 0; i < m->n; i++) {
        const size_t corners = mesh_corners(m, i);
        for (size_t k = 0; k < corners; k++) {
            const uint32_t a = place[m->elements[i][k]], b = place[m->elements[i][(k + 1) % corners]];
            edges[n++] = (part_edge){a < b ? a : b, a < b ? b : a, i};
        }
    }
    array_sort(edges, n, sizeof *edges, compare_edges);
    for (size_t first = 0, last; first < n; first = last) {
        for (last = first;
             last < n && edges[last].low == edges[first].low && edges[last].high == edges[first].high;)
            last++;
        for (size_t a = first; a < last; a++)
            for (size_t b = a + 1; b < last; b++) {
                const uint32_t i = edges[a].element, j = edges[b].element;
                if (m->group[i] == m->group[j] && cosine_of(m, i, j) > plane_parallel &&
                    off_plane(m, i, j) <= flat && off_plane(m, j, i) <= flat)
                    union_find_join(parent, i, j);
            }
    }
done:
    free(place);
    free(edges);
    return status;
}

/* Joins elements of one face, group and side to the one before; first: room for each face. */
static void join_by_faces(const mesh *m, uint32_t *first, uint32_t *parent) {
    const scene_faces *f = &m->faces;
    for (size_t k = 0; k < f->n_faces; k++) first[k] = UINT32_MAX;
    for (uint32_t i = 0; i < m->n; i++) {
        if (f->of[i] >= f->n_faces) continue;
        uint32_t *known = &first[f->of[i]];
        if (*known != UINT32_MAX && m->group[i] == m->group[*known] &&
            cosine_of(m, i, *known) > plane_parallel)
            union_find_join(parent, i, *known);
        else
            *known = i;
    }
}

lam_status plane_parts_find(const mesh *m, uint32_t *part, size_t *n_parts, lam_error *error) {
    lam_status status = LAM_OK;
    double centre[3], radius;
    uint32_t *first = NULL;
    bool *curved = memory_allocate(m->n, sizeof *curved, what, error);
    if (curved == NULL) TRY(LAM_ERR_MEMORY);
    mesh_bounds(m, centre, &radius);
    const double flat = plane_flatness * radius;
    for (uint32_t i = 0; i < m->n; i++) part[i] = i;
    TRY(join_by_edges(m, flat, part, error));
    if (m->faces.of != NULL) {
        first = memory_allocate(m->faces.n_faces, sizeof *first, what, error);
        if (first == NULL) TRY(LAM_ERR_MEMORY);
        join_by_faces(m, first, part);
    }
    /* A row of faces that turn little by little is not plane. */
    for (uint32_t i = 0; i < m->n; i++) {
        const uint32_t root = union_find_root(part, i);
        if (off_plane(m, root, i) > 4 * flat) curved[root] = true;
    }
    for (uint32_t i = 0; i < m->n; i++) part[i] = union_find_root(part, i);
    for (uint32_t i = (uint32_t)m->n; i-- > 0;)
        if (curved[part[i]]) part[i] = i;
    *n_parts = union_find_number(part, m->n);
done:
    free(curved);
    free(first);
    return status;
}
