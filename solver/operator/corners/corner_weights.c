#include "solver/operator/corners/corner_weights.h"

#include "solver/base/vector3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* At most so many elements around a node take part. */
enum { AROUND_MOST = 96 };
/* The share of the trace that is added to the diagonal of the normal equations, so that elements in one line
 * give a gradient along it. */
static const double ridge = 1e-9;
/* Of the elements at a node alone a weight is at least this, or those around them take part. */
static const double weight_least = -.1;
/* The largest sum of the magnitudes of weights: the corner of an even mesh has 2.5 to 3. */
static const double magnitude_most = 4;

/* Something near a place: where it is from there, in the plane, its influence on the fit, and its weight. */
typedef struct near_item {
    uint32_t index; /* of an element, or of a node */
    double at[2];
    double influence, weight;
} near_item;

typedef struct weighing {
    const corner_mesh *m;
    const corner_nodes *nodes;
    double (*centre)[3];         /* [n] */
    size_t *from;                /* [n_nodes + 1] */
    uint32_t *around, *position; /* the elements whose polygons have node j, and its place in these */
    uint32_t *seen;              /* [n]: 1 + the last node that took the element */
    near_item near[AROUND_MOST];
    size_t n_near, n_first; /* the first of them are at the node itself */
    corner_rows *rows;
} weighing;

static double triangle_area(const double *a, const double *b, const double *c) {
    double ab[3], ac[3], normal[3];
    subtract3(b, a, ab);
    subtract3(c, a, ac);
    cross3(ab, ac, normal);
    return sqrt(dot3(normal, normal)) / 2;
}

/* As mesh_centroid (solver/scene/mesh.c). */
static void find_centre(const corner_mesh *m, size_t i, double centre[3]) {
    const uint32_t *e = m->elements[i];
    const double *a = m->vertices[e[0]], *b = m->vertices[e[1]], *c = m->vertices[e[2]];
    const double *d = e[3] == CORNER_NONE ? c : m->vertices[e[3]];
    const double abc = triangle_area(a, b, c), acd = triangle_area(a, c, d);
    const double share = abc + acd > 0 ? acd / (abc + acd) : 0;
    for (int k = 0; k < 3; k++)
        centre[k] = a[k] + ((c[k] - a[k]) + (1 - share) * (b[k] - a[k]) + share * (d[k] - a[k])) / 3;
}

static lam_status list_around(weighing *w, lam_error *error) {
    const corner_nodes *nodes = w->nodes;
    const size_t n = w->m->n, count = nodes->ring_start[n];
    w->from = memory_allocate(nodes->n_nodes + 2, sizeof *w->from, "corners", error);
    w->around = memory_allocate(count, sizeof *w->around, "corners", error);
    w->position = memory_allocate(count, sizeof *w->position, "corners", error);
    w->centre = memory_allocate(n, sizeof *w->centre, "corners", error);
    w->seen = memory_allocate(n, sizeof *w->seen, "corners", error);
    if (w->from == NULL || w->around == NULL || w->position == NULL || w->centre == NULL || w->seen == NULL)
        return LAM_ERR_MEMORY;
    size_t *const from = w->from + 1; /* counts first; then places, which end as the next node's first */
    for (size_t k = 0; k < count; k++) from[nodes->ring[k] + 1]++;
    for (size_t j = 0; j < nodes->n_nodes; j++) from[j + 1] += from[j];
    for (uint32_t i = 0; i < n; i++) {
        find_centre(w->m, i, w->centre[i]);
        for (size_t k = nodes->ring_start[i]; k < nodes->ring_start[i + 1]; k++) {
            const size_t at = from[nodes->ring[k]]++;
            w->around[at] = i;
            w->position[at] = (uint32_t)(k - nodes->ring_start[i]);
        }
    }
    return LAM_OK;
}

static const double *point_of(const weighing *w, uint32_t node) {
    return w->m->vertices[w->nodes->vertex[node]];
}

/* The angle of an element's polygon at a place of it: weights by angle do not depend on how a surface is cut
 * into triangles. */
static double angle_at(const weighing *w, uint32_t element, size_t position) {
    const size_t first = w->nodes->ring_start[element], count = w->nodes->ring_start[element + 1] - first;
    const uint32_t *ring = w->nodes->ring + first;
    const double *here = point_of(w, ring[position]);
    double after[3], before[3];
    subtract3(point_of(w, ring[(position + 1) % count]), here, after);
    subtract3(point_of(w, ring[(position + count - 1) % count]), here, before);
    const double lengths = sqrt(dot3(after, after) * dot3(before, before));
    return lengths > 0 ? acos(fmax(-1, fmin(1, dot3(after, before) / lengths))) : 0;
}

static void add_near(weighing *w, uint32_t node, uint32_t element, double influence) {
    if (w->n_near == AROUND_MOST || w->seen[element] == node + 1) return;
    w->seen[element] = node + 1;
    w->near[w->n_near++] = (near_item){.index = element, .influence = influence};
}

/* Puts the elements from the kth on into the plane through the node, of normal u x v. */
static void project(weighing *w, uint32_t node, size_t k, double (*axes)[3]) {
    for (; k < w->n_near; k++) {
        double apart[3];
        subtract3(w->centre[w->near[k].index], point_of(w, node), apart);
        for (int a = 0; a < 2; a++) w->near[k].at[a] = dot3(apart, axes[a]);
    }
}

/* Two axes of length 1 across a normal of any length. */
static void axes_across(const double normal[3], double (*axes)[3]) {
    int least = 0;
    for (int d = 1; d < 3; d++)
        if (fabs(normal[d]) < fabs(normal[least])) least = d;
    double any[3] = {0, 0, 0};
    any[least] = 1;
    cross3(normal, any, axes[0]);
    cross3(normal, axes[0], axes[1]);
    for (int a = 0; a < 2; a++) {
        const double length = sqrt(dot3(axes[a], axes[a]));
        for (int d = 0; d < 3; d++) axes[a][d] = length > 0 ? axes[a][d] / length : 0;
    }
}

/* The axes across the mean normal of the elements at the node. */
static void find_axes(const weighing *w, double (*axes)[3]) {
    double normal[3] = {0, 0, 0};
    for (size_t k = 0; k < w->n_near; k++)
        for (int d = 0; d < 3; d++)
            normal[d] += w->near[k].influence * (double)w->m->normal[w->near[k].index][d];
    axes_across(normal, axes);
}

/* The weights of the value that the linear fit has at the place, w_k = o_k / O (1 - c^T M^-1 (d_k - c)) with
 * influences o of sum O, places d, their mean c = sum o d / O and M = sum o (d - c)(d - c)^T / O. False where
 * they don't reproduce linear light, or one is too far below 0. */
static bool fit(near_item *near, size_t count) {
    double sum = 0, mean[2] = {0, 0}, M[3] = {0, 0, 0}, left[2] = {0, 0}, least = 1;
    for (size_t k = 0; k < count; k++) {
        sum += near[k].influence;
        for (int d = 0; d < 2; d++) mean[d] += near[k].influence * near[k].at[d];
    }
    for (int d = 0; d < 2; d++) mean[d] /= sum;
    for (size_t k = 0; k < count; k++) {
        const double x = near[k].at[0] - mean[0], y = near[k].at[1] - mean[1];
        const double share = near[k].influence / sum;
        M[0] += share * x * x;
        M[1] += share * x * y;
        M[2] += share * y * y;
    }
    const double trace = M[0] + M[2], size = trace + mean[0] * mean[0] + mean[1] * mean[1];
    const double a = M[0] + ridge * trace, c = M[2] + ridge * trace, det = a * c - M[1] * M[1];
    /* One element, or several at one place, have no slope but that of rounding. */
    const bool sloped = det > 0 && trace > 1e-12 * size;
    const double slope[2] = {sloped ? (c * mean[0] - M[1] * mean[1]) / det : 0,
                             sloped ? (a * mean[1] - M[1] * mean[0]) / det : 0};
    for (size_t k = 0; k < count; k++) {
        const double x = near[k].at[0] - mean[0], y = near[k].at[1] - mean[1];
        near[k].weight = near[k].influence / sum * (1 - slope[0] * x - slope[1] * y);
        least = fmin(least, near[k].weight);
        for (int d = 0; d < 2; d++) left[d] += near[k].weight * near[k].at[d];
    }
    return least >= weight_least && left[0] * left[0] + left[1] * left[1] <= 1e-12 * size;
}

/* Adds the elements around the corners of those at the node. */
static void widen(weighing *w, uint32_t node, double (*axes)[3]) {
    double square = 0, angle = 0;
    w->n_first = w->n_near;
    for (size_t k = 0; k < w->n_first; k++) {
        square += w->near[k].at[0] * w->near[k].at[0] + w->near[k].at[1] * w->near[k].at[1];
        angle += w->near[k].influence;
    }
    for (size_t k = 0; k < w->n_first; k++) {
        const uint32_t i = w->near[k].index;
        for (size_t at = w->nodes->ring_start[i]; at < w->nodes->ring_start[i + 1]; at++) {
            const uint32_t other = w->nodes->ring[at];
            for (size_t q = w->from[other]; q < w->from[other + 1]; q++) add_near(w, node, w->around[q], 0);
        }
    }
    project(w, node, w->n_first, axes);
    for (size_t k = w->n_first; k < w->n_near; k++) {
        near_item *p = &w->near[k];
        const double away = p->at[0] * p->at[0] + p->at[1] * p->at[1], count = (double)w->n_first;
        p->influence = angle / count * fmin(1, away > 0 ? square / count / away : 1);
    }
}

/* Mixes in the mean by angles of the elements at the node until weights are not too large. */
static void bound(weighing *w) {
    double magnitude = 0, apart = 0, sum = 0;
    for (size_t k = 0; k < w->n_near; k++) magnitude += fabs(w->near[k].weight);
    if (magnitude <= magnitude_most) return;
    for (size_t k = 0; k < w->n_first; k++) sum += w->near[k].influence;
    for (size_t k = 0; k < w->n_near; k++)
        apart += fabs(w->near[k].weight - (k < w->n_first ? w->near[k].influence / sum : 0));
    const double share = fmin(1, (magnitude_most - 1) / apart);
    for (size_t k = 0; k < w->n_near; k++) {
        near_item *p = &w->near[k];
        const double plain = k < w->n_first ? p->influence / sum : 0;
        p->weight = plain + share * (p->weight - plain);
    }
}

static int compare_near(const void *left, const void *right) {
    const near_item *a = left, *b = right;
    return (a->index > b->index) - (a->index < b->index);
}

static lam_status put_row(near_item *near, size_t count, corner_rows *rows, lam_error *error) {
    uint32_t columns[AROUND_MOST];
    double weights[AROUND_MOST];
    qsort(near, count, sizeof *near, compare_near);
    for (size_t k = 0; k < count; k++) {
        columns[k] = near[k].index;
        weights[k] = near[k].weight;
    }
    return corner_rows_add(rows, count, columns, weights, error);
}

/* Appends the row of a node. */
static lam_status add_row(weighing *w, uint32_t node, lam_error *error) {
    double axes[2][3];
    w->n_near = 0;
    /* Angles above 0, so that slivers alone have a mean. */
    for (size_t q = w->from[node]; q < w->from[node + 1]; q++)
        add_near(w, node, w->around[q], angle_at(w, w->around[q], w->position[q]) + 1e-9);
    w->n_first = w->n_near;
    find_axes(w, axes);
    project(w, node, 0, axes);
    if (!fit(w->near, w->n_near)) {
        widen(w, node, axes);
        (void)fit(w->near, w->n_near);
        bound(w);
    }
    return put_row(w->near, w->n_near, w->rows, error);
}

lam_status corner_weights_find(const corner_mesh *m, const corner_nodes *nodes, const bool *tied,
                               corner_rows *out, lam_error *error) {
    lam_status status = LAM_OK;
    corner_rows rows = {.n_rows = 0};
    weighing *w = memory_allocate(1, sizeof *w, "corners", error);
    if (w == NULL) return LAM_ERR_MEMORY;
    w->m = m;
    w->nodes = nodes;
    w->rows = &rows;
    TRY(list_around(w, error));
    TRY(corner_rows_begin(&rows, nodes->n_nodes, error));
    for (uint32_t j = 0; j < nodes->n_nodes; j++)
        TRY(tied[j] ? corner_rows_add(&rows, 0, NULL, NULL, error) : add_row(w, j, error));
    TRY(corner_rows_end(&rows, error));
    *out = rows;
    rows = (corner_rows){.n_rows = 0};
done:
    corner_rows_free(&rows);
    free(w->from);
    free(w->around);
    free(w->position);
    free(w->centre);
    free(w->seen);
    free(w);
    return status;
}

/* The weights of the linear fit to the corners, at the centroid. */
static lam_status add_mean(const corner_mesh *m, const corner_nodes *nodes, size_t i, corner_rows *rows,
                           lam_error *error) {
    const size_t count = corner_mesh_count(m, i);
    near_item near[4];
    double centre[3], normal[3], axes[2][3];
    find_centre(m, i, centre);
    for (int d = 0; d < 3; d++) normal[d] = (double)m->normal[i][d];
    axes_across(normal, axes);
    for (size_t k = 0; k < count; k++) {
        double apart[3];
        subtract3(m->vertices[m->elements[i][k]], centre, apart);
        near[k] = (near_item){.index = nodes->corner[i][k], .influence = 1};
        for (int a = 0; a < 2; a++) near[k].at[a] = dot3(apart, axes[a]);
    }
    (void)fit(near, count);
    return put_row(near, count, rows, error);
}

lam_status corner_means_find(const corner_mesh *m, const corner_nodes *nodes, corner_rows *out,
                             lam_error *error) {
    lam_status status = LAM_OK;
    corner_rows rows = {.n_rows = 0};
    TRY(corner_rows_begin(&rows, m->n, error));
    for (size_t i = 0; i < m->n; i++) TRY(add_mean(m, nodes, i, &rows, error));
    TRY(corner_rows_end(&rows, error));
    *out = rows;
    rows = (corner_rows){.n_rows = 0};
done:
    corner_rows_free(&rows);
    return status;
}
