#include "solver/formfactor/blocks/unhidden.h"

#include "solver/base/vector3.h"
#include "solver/formfactor/blocks/blocks.h"
#include "solver/formfactor/exchange/polygon.h"
#include "solver/formfactor/sight/open_scene.h"
#include "store/status.h"

#include <math.h>
#include <stdlib.h>

/* Edges of a boundary that row sums are worth. */
enum { EDGES_MOST = 2048 };
/* Elements within this many of their radii of the boundary see it differently from point to point. */
static const double near_boundary = 8;

lam_status plane_tree_look(const mesh *m, plane_tree *tree, lam_error *error) {
    lam_status status = LAM_OK;
    bool unhidden = false;
    if (blocks_are_planar(tree)) return LAM_OK;
    TRY(mesh_is_unhidden(m, &unhidden, NULL, error));
    tree->view = unhidden ? PLANE_VIEW_UNHIDDEN : PLANE_VIEW_HIDDEN;
done:
    return status;
}

/* An edge from one vertex to another as an element has it, and the number of elements that have it so less
 * that of those that have it the other way. */
typedef struct mesh_edge {
    uint32_t from, to;
    int times;
} mesh_edge;

static int by_ends(const void *left, const void *right) {
    const mesh_edge *a = left, *b = right;
    if (a->from != b->from) return a->from < b->from ? -1 : 1;
    return a->to < b->to ? -1 : a->to > b->to;
}

/* edges, room for 4 n: those that are left when neighbours cancel. Returns their number. */
static size_t find_boundary(const mesh *m, mesh_edge *edges) {
    size_t count = 0, kept = 0;
    for (size_t i = 0; i < m->n; i++) {
        const uint32_t *v = m->elements[i];
        for (size_t k = 0; k < corner_count(v); k++) {
            const uint32_t from = v[k], to = v[(k + 1) % corner_count(v)];
            edges[count++] = from < to ? (mesh_edge){from, to, 1} : (mesh_edge){to, from, -1};
        }
    }
    qsort(edges, count, sizeof *edges, by_ends);
    for (size_t e = 0; e < count;) {
        mesh_edge sum = edges[e++];
        for (; e < count && by_ends(&edges[e], &sum) == 0; e++) sum.times += edges[e].times;
        if (sum.times != 0) edges[kept++] = sum;
    }
    return kept;
}

/* The edges where a scene ends. */
typedef struct boundary {
    const mesh *m;
    size_t count;
    const mesh_edge *edges;
} boundary;

/* All that a point with a normal sees of the scene; *nearest: its distance from the boundary. */
static double seen_at(const boundary *b, const double point[3], const double normal[3], double *nearest) {
    double sum = 0, least = INFINITY;
    for (size_t e = 0; e < b->count; e++) {
        const double *from = b->m->vertices[b->edges[e].from], *to = b->m->vertices[b->edges[e].to];
        double x[3], y[3], across[3];
        subtract3(from, point, x);
        subtract3(to, point, y);
        cross3(x, y, across);
        const double length = sqrt(dot3(across, across));
        least = fmin(least, fmin(dot3(x, x), dot3(y, y)));
        if (length > 0) sum += b->edges[e].times * atan2(length, dot3(x, y)) * dot3(normal, across) / length;
    }
    *nearest = sqrt(least);
    return fmin(fmax(1 - sum / (2 * M_PI), 0), 1);
}

/* The mean over the triangles between the centre and each side of an element, at their centroids. */
static double seen_from_parts(const boundary *b, const polygon *shape) {
    double sum = 0, area = 0, nearest;
    for (int k = 0; k < shape->n; k++) {
        polygon part = {.n = 3};
        double point[3];
        for (int d = 0; d < 3; d++) {
            part.corner[0][d] = shape->centre[d];
            part.corner[1][d] = shape->corner[k][d];
            part.corner[2][d] = shape->corner[(k + 1) % shape->n][d];
            point[d] = (part.corner[0][d] + part.corner[1][d] + part.corner[2][d]) / 3;
        }
        const double own = polygon_area(&part);
        sum += own * seen_at(b, point, shape->normal, &nearest);
        area += own;
    }
    return sum / area;
}

lam_status unhidden_row_sums(const mesh *m, bool *known, double *sums, lam_error *error) {
    lam_status status = LAM_OK;
    mesh_edge *edges = memory_allocate(m->n, 4 * sizeof *edges, "row sums", error);
    if (edges == NULL) TRY(LAM_ERR_MEMORY);
    const boundary b = {.m = m, .count = find_boundary(m, edges), .edges = edges};
    *known = b.count <= EDGES_MOST;
    if (!*known) goto done;
#pragma omp parallel for schedule(dynamic, 64)
    for (size_t i = 0; i < m->n; i++) {
        polygon shape;
        double centroid[3], nearest;
        polygon_of_element(m, i, &shape);
        mesh_centroid(m, i, centroid);
        sums[i] = seen_at(&b, centroid, shape.normal, &nearest);
        if (nearest < near_boundary * shape.radius) sums[i] = seen_from_parts(&b, &shape);
    }
done:
    free(edges);
    return status;
}
