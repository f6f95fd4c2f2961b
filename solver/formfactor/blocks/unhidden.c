#include "solver/formfactor/blocks/unhidden.h"

#include "solver/base/vector3.h"
#include "solver/formfactor/pairs/polygon.h"
#include "store/status.h"

#include <math.h>
#include <stdlib.h>

/* Nothing shorter than this share of the extent of the scene is a distance. */
static const double least_length = 1e-7;

/* Nodes that wait while a tree is descended: halves hold a quarter of a node or more, so that a path of 2^32
 * elements has at most 32 / log2(4/3) = 78 nodes. */
enum { WAITING_MOST = 128 };
/* Edges of a boundary that row sums are worth. */
enum { EDGES_MOST = 2048 };
/* Elements within this many of their radii of the boundary see it differently from point to point. */
static const double near_boundary = 8;

/* The box around all vertices of a cluster. */
typedef struct vertex_box {
    double middle[3], half[3];
} vertex_box;

/* A plane: normal . x = level. */
typedef struct element_plane {
    double normal[3], level;
} element_plane;

static void widen(double low[3], double high[3], const double *least, const double *most) {
    for (int d = 0; d < 3; d++) {
        low[d] = fmin(low[d], least[d]);
        high[d] = fmax(high[d], most[d]);
    }
}

static vertex_box box_of(const mesh *m, const plane_tree *tree, const vertex_box *boxes, size_t t) {
    const plane_cluster *c = &tree->clusters[t];
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    vertex_box out;
    for (uint32_t p = c->begin; c->leaf && p < c->end; p++) {
        const uint32_t *corners = m->elements[tree->order[p]];
        for (size_t k = 0; k < corner_count(corners); k++)
            widen(low, high, m->vertices[corners[k]], m->vertices[corners[k]]);
    }
    for (int side = 0; !c->leaf && side < 2; side++) {
        const vertex_box *child = &boxes[side == 0 ? c->left : t - 1];
        double least[3], most[3];
        for (int d = 0; d < 3; d++) {
            least[d] = child->middle[d] - child->half[d];
            most[d] = child->middle[d] + child->half[d];
        }
        widen(low, high, least, most);
    }
    for (int d = 0; d < 3; d++) {
        out.middle[d] = .5 * (low[d] + high[d]);
        out.half[d] = .5 * (high[d] - low[d]);
    }
    return out;
}

static element_plane plane_of(const mesh *m, size_t element) {
    polygon shape;
    element_plane out;
    polygon_of_element(m, element, &shape);
    for (int d = 0; d < 3; d++) out.normal[d] = shape.normal[d];
    out.level = dot3(shape.normal, shape.centre);
    return out;
}

static bool is_in_front(const mesh *m, const element_plane *plane, size_t element, double slack) {
    const uint32_t *corners = m->elements[element];
    for (size_t k = 0; k < corner_count(corners); k++)
        if (dot3(plane->normal, m->vertices[corners[k]]) < plane->level - slack) return false;
    return true;
}

/* True where no cluster of the tree has a vertex behind a plane; waiting: room for WAITING_MOST. */
static bool all_in_front(const mesh *m, const plane_tree *tree, const vertex_box *boxes,
                         const element_plane *plane, double slack, uint32_t *waiting) {
    size_t n_waiting = 0;
    waiting[n_waiting++] = (uint32_t)tree->n_clusters - 1;
    while (n_waiting > 0) {
        const uint32_t t = waiting[--n_waiting];
        const vertex_box *box = &boxes[t];
        double least = dot3(plane->normal, box->middle) - plane->level;
        for (int d = 0; d < 3; d++) least -= fabs(plane->normal[d]) * box->half[d];
        if (least >= -slack) continue;
        const plane_cluster *c = &tree->clusters[t];
        for (uint32_t p = c->begin; c->leaf && p < c->end; p++)
            if (!is_in_front(m, plane, tree->order[p], slack)) return false;
        if (c->leaf) continue;
        waiting[n_waiting++] = c->left;
        waiting[n_waiting++] = t - 1;
    }
    return true;
}

lam_status mesh_is_unhidden(const mesh *m, const plane_tree *tree, bool *out, lam_error *error) {
    lam_status status = LAM_OK;
    double centre[3], radius;
    vertex_box *boxes = memory_allocate(tree->n_clusters, sizeof *boxes, "clusters", error);
    if (boxes == NULL) TRY(LAM_ERR_MEMORY);
    mesh_bounds(m, centre, &radius);
    for (size_t t = 0; t < tree->n_clusters; t++) boxes[t] = box_of(m, tree, boxes, t);
    int hidden = 0;
#pragma omp parallel for schedule(dynamic, 64)
    for (size_t p = 0; p < m->n; p++) {
        uint32_t waiting[WAITING_MOST];
        if (__atomic_load_n(&hidden, __ATOMIC_RELAXED)) continue;
        const element_plane plane = plane_of(m, tree->order[p]);
        if (!all_in_front(m, tree, boxes, &plane, 2 * radius * least_length, waiting))
            __atomic_store_n(&hidden, 1, __ATOMIC_RELAXED);
    }
    *out = hidden == 0;
done:
    free(boxes);
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
        for (int d = 0; d < 3; d++) {
            x[d] = from[d] - point[d];
            y[d] = to[d] - point[d];
        }
        for (int d = 0; d < 3; d++) {
            const int f = (d + 1) % 3, g = (d + 2) % 3;
            across[d] = x[f] * y[g] - x[g] * y[f];
        }
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
