#include "solver/scene/facet/facet_holes.h"

#include "solver/base/array_sort.h"
#include "solver/base/union_find.h"
#include "solver/scene/tables.h"

#include <math.h>
#include <stdlib.h>

static double length_of(const double a[3]) {
    return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
}

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

double plane_rectangle_area(const plane_rectangle *r) {
    return length_of(r->edge[0]) * length_of(r->edge[1]);
}

bool plane_rectangle_around(const double (*points)[3], size_t n, const uint32_t (*edges)[2], size_t n_edges,
                            double flat, plane_rectangle *out) {
    double u[3] = {0}, w[3] = {0}, normal[3], longest = 0, widest = 0, low[2] = {0, 0}, high[2] = {0, 0};
    for (size_t e = 0; e < n_edges; e++) {
        double side[3];
        for (int d = 0; d < 3; d++) side[d] = points[edges[e][1]][d] - points[edges[e][0]][d];
        const double length = length_of(side);
        if (length <= longest) continue;
        longest = length;
        for (int d = 0; d < 3; d++) u[d] = side[d] / length;
    }
    if (!(longest > flat)) return false;
    for (size_t i = 0; i < n; i++) { /* the point that is furthest from the line along u */
        double r[3];
        for (int d = 0; d < 3; d++) r[d] = points[i][d] - points[0][d];
        const double along = dot(r, u);
        for (int d = 0; d < 3; d++) r[d] -= along * u[d];
        const double width = length_of(r);
        if (width <= widest) continue;
        widest = width;
        for (int d = 0; d < 3; d++) w[d] = r[d] / width;
    }
    if (!(widest > flat)) return false;
    normal[0] = u[1] * w[2] - u[2] * w[1];
    normal[1] = u[2] * w[0] - u[0] * w[2];
    normal[2] = u[0] * w[1] - u[1] * w[0];
    for (size_t i = 0; i < n; i++) {
        double r[3];
        for (int d = 0; d < 3; d++) r[d] = points[i][d] - points[0][d];
        if (fabs(dot(r, normal)) > flat) return false;
        const double at[2] = {dot(r, u), dot(r, w)};
        for (int k = 0; k < 2; k++) {
            low[k] = fmin(low[k], at[k]);
            high[k] = fmax(high[k], at[k]);
        }
    }
    for (int d = 0; d < 3; d++) {
        out->corner[d] = points[0][d] + low[0] * u[d] + low[1] * w[d];
        out->edge[0][d] = (high[0] - low[0]) * u[d];
        out->edge[1][d] = (high[1] - low[1]) * w[d];
    }
    return true;
}

/* An edge of a piece, or of a loop; a loop is known by its smallest vertex. */
typedef struct loop_edge {
    uint32_t loop, low, high;
} loop_edge;

static int edge_order(const void *one, const void *other) {
    const loop_edge *a = one, *b = other;
    if (a->loop != b->loop) return a->loop < b->loop ? -1 : 1;
    if (a->low != b->low) return a->low < b->low ? -1 : 1;
    return (a->high > b->high) - (a->high < b->high);
}

static int larger_first(const void *one, const void *other) {
    const double a = plane_rectangle_area(one), b = plane_rectangle_area(other);
    return (a < b) - (a > b);
}

/* The edges of all pieces that no other piece has, sorted by the loops that they make; *out freed with
 * free().
 */
static lam_status find_loops(const mesh *m, const facets *f, loop_edge **out, size_t *n, lam_error *error) {
    lam_status status = LAM_OK;
    size_t all = 0, kept = 0;
    uint32_t *place = memory_allocate(m->n_vertices, sizeof *place, "holes", error);
    uint32_t *parent = memory_allocate(m->n_vertices, sizeof *parent, "holes", error);
    loop_edge *edges = memory_allocate(4 * f->n_pieces + 1, sizeof *edges, "holes", error);
    if (place == NULL || parent == NULL || edges == NULL) TRY(LAM_ERR_MEMORY);
    TRY(points_weld(m->n_vertices, (const double(*)[3])m->vertices, place, error));
    for (size_t p = 0; p < f->n_pieces; p++)
        for (size_t c = 0, corners = corner_count(f->pieces[p]); c < corners; c++) {
            const uint32_t a = place[f->pieces[p][c]], b = place[f->pieces[p][(c + 1) % corners]];
            if (a != b) edges[all++] = (loop_edge){0, a < b ? a : b, a < b ? b : a};
        }
    array_sort(edges, all, sizeof *edges, edge_order);
    for (uint32_t i = 0; i < m->n_vertices; i++) parent[i] = i;
    for (size_t e = 0, next; e < all; e = next) {
        for (next = e + 1; next < all && edge_order(edges + e, edges + next) == 0;) next++;
        if (next - e > 1) continue;
        (void)union_find_join(parent, edges[e].low, edges[e].high);
        edges[kept++] = edges[e];
    }
    for (size_t e = 0; e < kept; e++) edges[e].loop = union_find_root(parent, edges[e].low);
    array_sort(edges, kept, sizeof *edges, edge_order);
    *out = edges;
    *n = kept;
    edges = NULL;
done:
    free(place);
    free(parent);
    free(edges);
    return status;
}

lam_status facet_holes(const mesh *m, const facets *f, double flat, plane_rectangle **out, size_t *n,
                       lam_error *error) {
    lam_status status = LAM_OK;
    loop_edge *edges = NULL;
    plane_rectangle *made = NULL;
    double(*points)[3] = NULL;
    uint32_t(*ends)[2] = NULL;
    size_t n_edges = 0, count = 0;
    TRY(find_loops(m, f, &edges, &n_edges, error));
    made = memory_allocate(n_edges / 3 + 1, sizeof *made, "holes", error);
    points = memory_allocate(2 * n_edges + 1, sizeof *points, "holes", error);
    ends = memory_allocate(n_edges + 1, sizeof *ends, "holes", error);
    if (made == NULL || points == NULL || ends == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t first = 0, next; first < n_edges; first = next) {
        size_t k = 0;
        for (next = first; next < n_edges && edges[next].loop == edges[first].loop; next++, k++) {
            for (int d = 0; d < 3; d++) {
                points[2 * k][d] = m->vertices[edges[next].low][d];
                points[2 * k + 1][d] = m->vertices[edges[next].high][d];
            }
            ends[k][0] = (uint32_t)(2 * k);
            ends[k][1] = (uint32_t)(2 * k + 1);
        }
        count += k >= 3 && plane_rectangle_around((const double(*)[3])points, 2 * k,
                                                  (const uint32_t(*)[2])ends, k, flat, &made[count]);
    }
    array_sort(made, count, sizeof *made, larger_first);
    *out = made;
    *n = count;
    made = NULL;
done:
    free(edges);
    free(made);
    free(points);
    free(ends);
    return status;
}
