#include "solver/formfactor/clusters/clusters.h"

#include "solver/base/vector3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The coordinates that clusters are split by: an element's centroid and its normal. */
typedef struct feature {
    double centre[3], normal[3];
} feature;

typedef struct builder {
    const mesh *m;
    const feature *features; /* [n], by element */
    double slack;
    uint32_t *spare; /* [n] */
    cluster_tree tree;
} builder;

void cluster_tree_free(cluster_tree *t) {
    free(t->clusters);
    free(t->element);
    free(t->position);
    *t = (cluster_tree){0};
}

static void measure_box(const builder *b, cluster *c) {
    const mesh *m = b->m;
    for (int d = 0; d < 3; d++) {
        c->low[d] = INFINITY;
        c->high[d] = -INFINITY;
    }
    for (uint32_t p = c->first; p < c->last; p++) {
        const uint32_t e = b->tree.element[p];
        for (size_t k = 0; k < mesh_corners(m, e); k++) {
            const double *x = m->vertices[m->elements[e][k]];
            for (int d = 0; d < 3; d++) {
                c->low[d] = fmin(c->low[d], x[d]);
                c->high[d] = fmax(c->high[d], x[d]);
            }
        }
        c->area += m->area[e];
        c->largest = fmax(c->largest, m->area[e]);
    }
}

/* The cone of the normals, and the plane if all elements share one. */
static void measure_directions(const builder *b, cluster *c) {
    const mesh *m = b->m;
    double sum[3] = {0};
    for (uint32_t p = c->first; p < c->last; p++)
        for (int d = 0; d < 3; d++) sum[d] += b->features[b->tree.element[p]].normal[d];
    const double length = sqrt(dot3(sum, sum));
    c->spread = 3.2; /* above pi: no bound */
    if (length < 1e-6 * (c->last - c->first)) return;
    for (int d = 0; d < 3; d++) c->normal[d] = sum[d] / length;
    double least = 1;
    for (uint32_t p = c->first; p < c->last; p++)
        least = fmin(least, dot3(b->features[b->tree.element[p]].normal, c->normal));
    /* Normals are in single precision: the rounding of a cosine near 1 is an angle of up to 1e-3. */
    c->spread = acos(fmax(least, -1)) + 1e-3;
    if (least < 1 - 1e-9) return;
    double low = INFINITY, high = -INFINITY;
    for (uint32_t p = c->first; p < c->last; p++) {
        const uint32_t e = b->tree.element[p];
        for (size_t k = 0; k < mesh_corners(m, e); k++) {
            const double level = dot3(m->vertices[m->elements[e][k]], c->normal);
            low = fmin(low, level);
            high = fmax(high, level);
        }
    }
    c->level = .5 * (low + high);
    c->plane = high - low <= b->slack;
}

/* The coordinate to split by, 0 ... 2 of the centroid or 3 ... 5 of the normal, and its middle; -1: all are
 * equal. */
static int longest_extent(const builder *b, const cluster *c, double *middle) {
    double low[6], high[6];
    for (int d = 0; d < 6; d++) {
        low[d] = INFINITY;
        high[d] = -INFINITY;
    }
    for (uint32_t p = c->first; p < c->last; p++) {
        const feature *f = &b->features[b->tree.element[p]];
        const double x[6] = {f->centre[0], f->centre[1], f->centre[2],
                             f->normal[0], f->normal[1], f->normal[2]};
        for (int d = 0; d < 6; d++) {
            low[d] = fmin(low[d], x[d]);
            high[d] = fmax(high[d], x[d]);
        }
    }
    const double size =
        sqrt((high[0] - low[0]) * (high[0] - low[0]) + (high[1] - low[1]) * (high[1] - low[1]) +
             (high[2] - low[2]) * (high[2] - low[2]));
    int best = -1;
    double most = 0;
    for (int d = 0; d < 6; d++) {
        /* A difference of 1 in a normal counts as much as the cluster's diagonal. */
        const double extent = d < 3 ? high[d] - low[d] : (high[d] - low[d]) * (size > 0 ? size : 1);
        if (!(extent > most)) continue;
        most = extent;
        best = d;
        *middle = .5 * (low[d] + high[d]);
    }
    return best;
}

/* Partitions a cluster's positions at the middle, stably; returns where the second part begins. */
static uint32_t split(builder *b, const cluster *c) {
    double middle = 0;
    const int by = longest_extent(b, c, &middle);
    const uint32_t half = c->first + (c->last - c->first) / 2;
    if (by < 0) return half;
    uint32_t *order = b->tree.element, n_left = 0, n_right = 0;
    for (uint32_t p = c->first; p < c->last; p++) {
        const feature *f = &b->features[order[p]];
        const double x = by < 3 ? f->centre[by] : f->normal[by - 3];
        if (x < middle)
            order[c->first + n_left++] = order[p];
        else
            b->spare[n_right++] = order[p];
    }
    memcpy(order + c->first + n_left, b->spare, n_right * sizeof *order);
    return n_left == 0 || n_right == 0 ? half : c->first + n_left;
}

static void build(builder *b) {
    cluster_tree *t = &b->tree;
    t->clusters[0] = (cluster){.last = (uint32_t)t->n};
    t->n_clusters = 1;
    for (size_t at = 0; at < t->n_clusters; at++) {
        cluster *c = &t->clusters[at];
        measure_box(b, c);
        measure_directions(b, c);
        if (c->last - c->first <= CLUSTER_LEAF) continue;
        const uint32_t middle = split(b, c);
        for (int k = 0; k < 2; k++) {
            c->child[k] = (uint32_t)t->n_clusters;
            t->clusters[t->n_clusters++] =
                (cluster){.first = k == 0 ? c->first : middle, .last = k == 0 ? middle : c->last};
        }
    }
}

lam_status cluster_tree_build(const mesh *m, double slack, cluster_tree *out, lam_error *error) {
    lam_status status = LAM_OK;
    builder b = {.m = m, .slack = slack, .tree = {.n = m->n}};
    feature *features = memory_allocate(m->n, sizeof *features, "clusters", error);
    b.spare = memory_allocate(m->n, sizeof *b.spare, "clusters", error);
    b.tree.element = memory_allocate(m->n, sizeof *b.tree.element, "clusters", error);
    b.tree.position = memory_allocate(m->n, sizeof *b.tree.position, "clusters", error);
    /* A binary tree without empty leaves. */
    b.tree.clusters = memory_allocate(m->n, 2 * sizeof *b.tree.clusters, "clusters", error);
    if (features == NULL || b.spare == NULL || b.tree.element == NULL || b.tree.position == NULL ||
        b.tree.clusters == NULL)
        TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < m->n; i++) {
        mesh_centroid(m, i, features[i].centre);
        for (int d = 0; d < 3; d++) features[i].normal[d] = (double)m->normal[i][d];
        b.tree.element[i] = (uint32_t)i;
    }
    b.features = features;
    build(&b);
    for (size_t p = 0; p < m->n; p++) b.tree.position[b.tree.element[p]] = (uint32_t)p;
    *out = b.tree;
    b.tree = (cluster_tree){0};
done:
    free(features);
    free(b.spare);
    cluster_tree_free(&b.tree);
    return status;
}

/* The largest value of normal . x over a box. */
static double reach(const cluster *box, const double normal[3]) {
    double most = 0;
    for (int d = 0; d < 3; d++) most += normal[d] * (normal[d] > 0 ? box->high[d] : box->low[d]);
    return most;
}

/* True where no point of b lies in front of any element of a: by a's plane, or because the angle between a's
 * mean normal and the direction to b exceeds pi/2 by more than the cone of a's normals and that of the
 * directions. */
static bool behind(const cluster *a, const cluster *b, double slack) {
    if (a->plane) return reach(b, a->normal) <= a->level + slack;
    double apart[3], size = 0;
    for (int d = 0; d < 3; d++) {
        const double wide = .5 * (a->high[d] - a->low[d] + b->high[d] - b->low[d]);
        apart[d] = .5 * (b->low[d] + b->high[d] - a->low[d] - a->high[d]);
        size += wide * wide;
    }
    const double distance = sqrt(dot3(apart, apart)), radius = sqrt(size);
    if (!(distance > radius)) return false;
    const double angle = acos(fmin(fmax(dot3(apart, a->normal) / distance, -1), 1));
    return angle - asin(radius / distance) - a->spread > 1.5707963267948966;
}

bool cluster_faces_away(const cluster *a, const cluster *b, double slack) {
    return behind(a, b, slack) || behind(b, a, slack);
}

double cluster_distance2(const cluster *a, const cluster *b) {
    double sum = 0;
    for (int d = 0; d < 3; d++) {
        const double gap = fmax(fmax(a->low[d] - b->high[d], b->low[d] - a->high[d]), 0);
        sum += gap * gap;
    }
    return sum;
}
