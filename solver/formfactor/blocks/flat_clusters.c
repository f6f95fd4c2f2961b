#include "solver/formfactor/blocks/flat_clusters.h"

#include "solver/base/vector3.h"
#include "solver/base/weighted.h"
#include "solver/scene/plane.h"

#include <math.h>
#include <stdlib.h>

/* Coordinates that are written with few digits put elements of one plane at heights that differ by less than
 * this share of the extent: millimetres in a kilometre. */
static const double least_height = 1e-6;
/* A rectangle is full where its elements leave out no more than this share. */
static const double same_area = 1e-6;

void flat_clusters_free(flat_clusters *f) {
    free(f->of);
    free(f->planes);
    free(f->before);
    free(f->set_range);
    *f = (flat_clusters){.m = NULL};
}

static void set_plane(const plane_frame *frame, flat_plane *p) {
    for (int d = 0; d < 3; d++) {
        p->origin[d] = frame->origin[d];
        for (int k = 0; k < 2; k++) p->axis[k][d] = frame->axis[k][d];
    }
    cross3(frame->axis[0], frame->axis[1], p->normal);
}

/* Bounds along both axes and of heights. */
typedef struct rectangle {
    double low[3], high[3], lowest_top, contact;
} rectangle;

static rectangle of_element(const mesh *m, const visibility *v, uint32_t element, const flat_plane *p) {
    rectangle r = {.low = {INFINITY, INFINITY, INFINITY}, .high = {-INFINITY, -INFINITY, -INFINITY}};
    for (size_t c = 0; c < mesh_corners(m, element); c++) {
        const double *x = m->vertices[m->elements[element][c]];
        for (int k = 0; k < 3; k++) {
            const double at = k < 2 ? dot3(p->axis[k], x) - dot3(p->axis[k], p->origin) : dot3(p->normal, x);
            r.low[k] = fmin(r.low[k], at);
            r.high[k] = fmax(r.high[k], at);
        }
    }
    r.contact = visibility_rise(v, element);
    r.lowest_top = r.high[2] + r.contact;
    return r;
}

/* The centroid lies within but for rounding. */
static void include(rectangle *r, const double point[2]) {
    for (int k = 0; k < 2; k++) {
        r->low[k] = fmin(r->low[k], point[k]);
        r->high[k] = fmax(r->high[k], point[k]);
    }
}

static rectangle joined(const rectangle *a, const rectangle *b) {
    rectangle r = {.lowest_top = fmin(a->lowest_top, b->lowest_top), .contact = fmax(a->contact, b->contact)};
    for (int k = 0; k < 3; k++) {
        r.low[k] = fmin(a->low[k], b->low[k]);
        r.high[k] = fmax(a->high[k], b->high[k]);
    }
    return r;
}

static void set_cluster(const flat_plane *p, const rectangle *r, double area, uint32_t plane, double slack,
                        flat_cluster *out) {
    *out = (flat_cluster){.area = area,
                          .plane = plane,
                          .set = FLAT_MIXED,
                          .level = .5 * (r->low[2] + r->high[2]),
                          .rise = .5 * (r->high[2] - r->low[2]),
                          .lowest_top = r->lowest_top,
                          .contact = r->contact};
    const double above = out->level - dot3(p->normal, p->origin);
    double middle[2];
    for (int k = 0; k < 2; k++) {
        out->half[k] = .5 * (r->high[k] - r->low[k]);
        middle[k] = .5 * (r->high[k] + r->low[k]);
    }
    for (int d = 0; d < 3; d++)
        out->centre[d] =
            p->origin[d] + middle[0] * p->axis[0][d] + middle[1] * p->axis[1][d] + above * p->normal[d];
    out->radius = hypot(out->half[0], out->half[1]);
    out->full = out->rise <= slack && area >= (1 - same_area) * 4 * out->half[0] * out->half[1];
}

/* The box around all corners of a cluster, along the axes of the scene. */
typedef struct corner_box {
    double low[3], high[3];
} corner_box;

static void include_corner(corner_box *box, const double *point) {
    for (int d = 0; d < 3; d++) {
        box->low[d] = fmin(box->low[d], point[d]);
        box->high[d] = fmax(box->high[d], point[d]);
    }
}

/* The box of a cluster, from its elements or from the boxes of its children. */
static corner_box box_of(const mesh *m, const plane_tree *tree, const corner_box *boxes, size_t t) {
    const plane_cluster *c = &tree->clusters[t];
    corner_box box = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    for (uint32_t p = c->begin; c->leaf && p < c->end; p++) {
        const uint32_t *corners = m->elements[tree->order[p]];
        for (size_t k = 0; k < corner_count(corners); k++) include_corner(&box, m->vertices[corners[k]]);
    }
    for (int side = 0; !c->leaf && side < 2; side++) {
        const corner_box *child = &boxes[side == 0 ? c->left : t - 1];
        include_corner(&box, child->low);
        include_corner(&box, child->high);
    }
    return box;
}

/* A cluster of several planes. */
static void set_above(const corner_box *box, double area, flat_cluster *out) {
    double square = 0;
    *out = (flat_cluster){.area = area, .plane = PLANE_ABOVE, .set = FLAT_MIXED};
    for (int d = 0; d < 3; d++) {
        out->centre[d] = .5 * (box->low[d] + box->high[d]);
        square += pow(.5 * (box->high[d] - box->low[d]), 2);
    }
    out->radius = sqrt(square);
}

/* Both sides of a two-sided element lie in one facet. */
static uint32_t facet_of(const mesh *m, const visibility *v, uint32_t element) {
    const size_t n_fronts = m->two_sided ? m->n / 2 : m->n;
    return visibility_facets(v)->of_element[element < n_fronts ? element : element - n_fronts];
}

lam_status flat_clusters_find_sets(const visibility *v, const plane_tree *tree, const occluders *o,
                                   flat_clusters *f, lam_error *error) {
    const size_t n_clusters = tree->n_clusters;
    f->set_range = memory_allocate(o->n_facets, sizeof *f->set_range, "clusters", error);
    if (f->set_range == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < o->n_facets; k++) f->set_range[k][0] = UINT32_MAX;
    for (uint32_t p = 0; p < f->m->n; p++) {
        const uint32_t set = o->set_of_facet[facet_of(f->m, v, tree->order[p])];
        flat_cluster *own = &f->of[n_clusters + p];
        own->set = set;
        own->begin = p;
        own->end = p + 1;
        if (p < f->set_range[set][0]) f->set_range[set][0] = p;
        f->set_range[set][1] = p;
    }
    for (size_t t = 0; t < n_clusters; t++) {
        const plane_cluster *c = &tree->clusters[t];
        flat_cluster *to = &f->of[t];
        to->begin = c->begin;
        to->end = c->end;
        to->set = f->of[n_clusters + c->begin].set;
        for (uint32_t p = c->begin; p < c->end && c->leaf; p++)
            if (f->of[n_clusters + p].set != to->set) to->set = FLAT_MIXED;
        if (!c->leaf && f->of[c->left].set != f->of[t - 1].set) to->set = FLAT_MIXED;
        if (!c->leaf && f->of[c->left].set == FLAT_MIXED) to->set = FLAT_MIXED;
    }
    return LAM_OK;
}

static double extent_of(const mesh *m) {
    double centre[3], radius;
    mesh_bounds(m, centre, &radius);
    return 2 * radius;
}

lam_status flat_clusters_make(const mesh *m, const visibility *v, const plane_tree *tree,
                              block_factors *blocks, flat_clusters *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = m->n, n_clusters = blocks->n_clusters, n_nodes = n_clusters + n;
    const double extent = extent_of(m);
    flat_clusters f = {.m = m,
                       .tree = blocks,
                       .n_planes = tree->n_frames,
                       .slack = plane_least_length * extent,
                       .flush = least_height * extent};
    rectangle *bounds = memory_allocate(n_nodes, sizeof *bounds, "clusters", error);
    corner_box *boxes = memory_allocate(n_clusters, sizeof *boxes, "clusters", error);
    f.of = memory_allocate(n_nodes, sizeof *f.of, "clusters", error);
    f.planes = memory_allocate(f.n_planes, sizeof *f.planes, "clusters", error);
    f.before = memory_allocate(n + 1, sizeof *f.before, "clusters", error);
    if (bounds == NULL || boxes == NULL || f.of == NULL || f.planes == NULL || f.before == NULL)
        TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < f.n_planes; k++) set_plane(&tree->frames[k], &f.planes[k]);
    for (size_t p = 0; p < n; p++) f.before[p + 1] = f.before[p] + blocks->area[p];
#pragma omp parallel for schedule(static)
    for (size_t t = 0; t < n_clusters; t++) {
        const plane_cluster *c = &tree->clusters[t];
        if (!c->leaf) continue;
        boxes[t] = box_of(m, tree, boxes, t);
        const flat_plane *plane = &f.planes[c->frame];
        for (uint32_t p = c->begin; p < c->end; p++) {
            const size_t own = n_clusters + p;
            bounds[own] = of_element(m, v, blocks->order[p], plane);
            include(&bounds[own], blocks->place[p]);
            bounds[t] = p == c->begin ? bounds[own] : joined(&bounds[t], &bounds[own]);
            set_cluster(plane, &bounds[own], blocks->area[p], c->frame, f.slack, &f.of[own]);
        }
    }
    for (size_t t = 0; t < n_clusters; t++) {
        const plane_cluster *c = &tree->clusters[t];
        block_node *node = &blocks->nodes[t];
        if (!c->leaf) boxes[t] = box_of(m, tree, boxes, t);
        if (c->frame == PLANE_ABOVE) {
            set_above(&boxes[t], f.before[c->end] - f.before[c->begin], &f.of[t]);
            continue;
        }
        const flat_plane *plane = &f.planes[c->frame];
        if (!c->leaf) bounds[t] = joined(&bounds[c->left], &bounds[t - 1]);
        set_cluster(plane, &bounds[t], f.before[c->end] - f.before[c->begin], c->frame, f.slack, &f.of[t]);
        for (int k = 0; k < 2; k++) {
            node->centre[k] = .5 * (bounds[t].low[k] + bounds[t].high[k]);
            /* Rounding would make the coordinates of narrower ones arbitrary. */
            node->over[k] = f.of[t].half[k] > f.slack ? 1 / f.of[t].half[k] : 0;
        }
    }
    *out = f;
    f = (flat_clusters){.m = NULL};
done:
    free(bounds);
    free(boxes);
    flat_clusters_free(&f);
    return status;
}

void flat_clusters_pair(const flat_clusters *f, uint32_t a, uint32_t b, flat_pair *out) {
    for (int e = 0; e < 2; e++) {
        const flat_cluster *c = &f->of[e == 0 ? a : b];
        const flat_plane *p = &f->planes[c->plane];
        for (int d = 0; d < 3; d++) {
            double *x = out->x[d] + (size_t)e * FLAT_CORNERS / 2;
            const double u = c->half[0] * p->axis[0][d], v = c->half[1] * p->axis[1][d];
            const double less = c->centre[d] - u, more = c->centre[d] + u;
            x[0] = less - v;
            x[1] = more - v;
            x[2] = more + v;
            x[3] = less + v;
        }
    }
}

void flat_cluster_point(const flat_clusters *f, uint32_t node, double u, double v, double point[3]) {
    const flat_cluster *c = &f->of[node];
    const flat_plane *p = &f->planes[c->plane];
    for (int d = 0; d < 3; d++)
        point[d] = c->centre[d] + u * c->half[0] * p->axis[0][d] + v * c->half[1] * p->axis[1][d];
}

double flat_cluster_distance(const flat_clusters *f, uint32_t node, const double point[3]) {
    const flat_cluster *c = &f->of[node];
    const flat_plane *p = &f->planes[c->plane];
    const double away[3] = {point[0] - c->centre[0], point[1] - c->centre[1], point[2] - c->centre[2]};
    const double u = fmax(fabs(dot3(away, p->axis[0])) - c->half[0], 0);
    const double v = fmax(fabs(dot3(away, p->axis[1])) - c->half[1], 0), w = dot3(away, p->normal);
    return sqrt(u * u + v * v + w * w);
}

/* The element below a node at which the given share of its area ends, and the rest of that share within it.
 */
static uint32_t element_at(const flat_clusters *f, uint32_t node, double share, double *rest) {
    const block_node *range = &f->tree->nodes[node];
    const double at = f->before[range->begin] + share * (f->before[range->end] - f->before[range->begin]);
    const uint32_t low =
        range->begin + (uint32_t)weighted_part(f->before + range->begin, range->end - range->begin, at);
    *rest = fmin(fmax((at - f->before[low]) / (f->before[low + 1] - f->before[low]), 0), 1);
    return low;
}

/* The point of an element at (u, w) in the unit square, as polygon_point has it. */
static void element_point(const mesh *m, uint32_t element, double u, double w, double point[3]) {
    const uint32_t *v = m->elements[element];
    const double *a = m->vertices[v[0]], *b = m->vertices[v[1]], *c = m->vertices[v[2]];
    if (v[3] == MESH_NO_VERTEX) { /* the square folded along its diagonal */
        const bool beyond = u + w > 1;
        const double s = beyond ? 1 - u : u, t = beyond ? 1 - w : w;
        for (int d = 0; d < 3; d++) point[d] = a[d] + s * (b[d] - a[d]) + t * (c[d] - a[d]);
        return;
    }
    const double *e = m->vertices[v[3]];
    for (int d = 0; d < 3; d++)
        point[d] = (1 - w) * ((1 - u) * a[d] + u * b[d]) + w * ((1 - u) * e[d] + u * c[d]);
}

uint32_t flat_cluster_sample(const flat_clusters *f, uint32_t node, double u, double v, double place[2],
                             double point[3]) {
    const flat_cluster *c = &f->of[node];
    double along;
    const uint32_t position = element_at(f, node, u, &along);
    element_point(f->m, f->tree->order[position], along, v, point);
    place[0] = place[1] = 0;
    if (c->plane == PLANE_ABOVE) return position;
    const flat_plane *p = &f->planes[c->plane];
    const double away[3] = {point[0] - c->centre[0], point[1] - c->centre[1], point[2] - c->centre[2]};
    for (int k = 0; k < 2; k++) place[k] = c->half[k] > 0 ? dot3(away, p->axis[k]) / c->half[k] : 0;
    return position;
}
