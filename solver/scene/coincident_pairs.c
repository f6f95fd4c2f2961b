#include "solver/scene/coincident_pairs.h"

#include "solver/base/array_grow.h"
#include "solver/scene/element_face.h"
#include "solver/scene/plane.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Faces that share less of the smaller one count as neighbours. */
static const double shared_least = 1e-3;

/* Cosine of the angle between normals above which faces may lie in one plane. The corners decide: the normal
 * of a face as small as the rounding of its corners says little. */
static const double alike = .9;

/* Faces in a leaf of the tree of boxes; corners that two convex quads have in common at most. */
enum { LEAF = 8, CORNERS_MOST = 8 };

/* Pairs of boxes or of faces that are looked at: this number for each face, and for all. A scene of n faces
 * that do not overlap takes about 40 n. */
static const double looks_of_face = 1000, looks_of_all = 1e8;

/* About the scene's centre: single precision is off by less than a tenth of the distance of planes. */
typedef struct box {
    float low[3], high[3];
} box;

typedef struct search {
    const mesh *m;
    bool both_sides;
    double centre[3], distance, looks;
    uint32_t *order; /* [n]: faces of one size and place follow each other */
    box *faces;      /* [n], in this order */
    box *nodes;      /* of the tree: the children of node k are 2k + 1 and 2k + 2 */
    coincident_pairs *out;
    lam_error *error;
} search;

double coincident_distance(const mesh *m) {
    double centre[3], radius;
    mesh_bounds(m, centre, &radius);
    return plane_same_place * radius;
}

/* fminf and fmaxf are calls. */
static inline float lower(float a, float b) {
    return a < b ? a : b;
}

static inline float higher(float a, float b) {
    return a > b ? a : b;
}

static box box_of(const mesh *m, size_t face, const double centre[3]) {
    box b;
    for (size_t c = 0; c < mesh_corners(m, face); c++)
        for (int d = 0; d < 3; d++) {
            const float x = (float)(m->vertices[m->elements[face][c]][d] - centre[d]);
            b.low[d] = c == 0 ? x : lower(b.low[d], x);
            b.high[d] = c == 0 ? x : higher(b.high[d], x);
        }
    return b;
}

/* True if a part of a plane may be in both: it is longer than `distance` along two axes at least. Faces that
 * share an edge along an axis are no further apart, but their boxes have only that axis in common. */
static inline bool boxes_share(const box *a, const box *b, float distance) {
    int long_axes = 0;
    for (int d = 0; d < 3; d++) {
        const float length = lower(a->high[d], b->high[d]) - higher(a->low[d], b->low[d]);
        if (length < -distance) return false;
        long_axes += length > distance;
    }
    return long_axes >= 2;
}

/* Sorts the faces of the Z-order by the size of their boxes, so that large ones are no part of the boxes of
 * small ones. Sizes differ by a factor of 4 from class to class. */
enum { SIZES = 64 };

static size_t size_of(const box *b) {
    float extent = 0;
    int exponent;
    for (int d = 0; d < 3; d++) extent = higher(extent, b->high[d] - b->low[d]);
    (void)frexpf(extent, &exponent);
    const int class = exponent / 2 + SIZES / 2;
    return class < 0 ? 0 : class >= SIZES ? SIZES - 1 : (size_t)class;
}

static lam_status sort_by_size(search *s) {
    const size_t n = s->m->n;
    size_t from[SIZES + 1] = {0};
    uint32_t *sorted = memory_allocate(n, sizeof *sorted, "overlapping faces", s->error);
    uint8_t *size = memory_allocate(n, sizeof *size, "overlapping faces", s->error);
    if (sorted == NULL || size == NULL) {
        free(sorted);
        free(size);
        return LAM_ERR_MEMORY;
    }
    for (size_t k = 0; k < n; k++) {
        const box b = box_of(s->m, k, s->centre);
        size[k] = (uint8_t)size_of(&b);
        from[size[k] + 1]++;
    }
    for (size_t c = 0; c < SIZES; c++) from[c + 1] += from[c];
    for (size_t k = 0; k < n; k++) sorted[from[size[s->order[k]]]++] = s->order[k];
    for (size_t k = 0; k < n; k++) s->faces[k] = box_of(s->m, sorted[k], s->centre);
    free(size);
    free(s->order);
    s->order = sorted;
    return LAM_OK;
}

/* Faces first ... last - 1 of the order, whose box is nodes[node]. */
typedef struct range {
    size_t node, first, last;
} range;

static bool is_leaf(range r) {
    return r.last - r.first <= LEAF;
}

static range child(range r, int which) {
    const size_t middle = r.first + (r.last - r.first) / 2;
    return which == 0 ? (range){2 * r.node + 1, r.first, middle} : (range){2 * r.node + 2, middle, r.last};
}

static void add_box(box *to, const box *b) {
    for (int d = 0; d < 3; d++) {
        to->low[d] = lower(to->low[d], b->low[d]);
        to->high[d] = higher(to->high[d], b->high[d]);
    }
}

/* Depth log2 n. */
static void make_boxes(search *s, range r) {
    box *to = &s->nodes[r.node];
    if (is_leaf(r)) {
        *to = s->faces[r.first];
        for (size_t k = r.first + 1; k < r.last; k++) add_box(to, &s->faces[k]);
        return;
    }
    for (int c = 0; c < 2; c++) make_boxes(s, child(r, c));
    *to = s->nodes[child(r, 0).node];
    add_box(to, &s->nodes[child(r, 1).node]);
}

/* A convex polygon in a plane. */
typedef struct flat_polygon {
    size_t n;
    double corner[CORNERS_MOST][2];
} flat_polygon;

static double flat_area(const flat_polygon *p) {
    double twice = 0;
    for (size_t k = 1; k + 1 < p->n; k++) twice += plane_turn(p->corner[0], p->corner[k], p->corner[k + 1]);
    return .5 * fabs(twice);
}

/* The part of p to the left of the line from a to b (Sutherland and Hodgman 1974). */
static flat_polygon clip(const flat_polygon *p, const double a[2], const double b[2]) {
    flat_polygon out = {.n = 0};
    for (size_t k = 0; k < p->n; k++) {
        const double *from = p->corner[k], *to = p->corner[(k + 1) % p->n];
        const double here = plane_turn(a, b, from), there = plane_turn(a, b, to);
        if (here >= 0 && out.n < CORNERS_MOST) memcpy(out.corner[out.n++], from, sizeof out.corner[0]);
        if ((here >= 0) == (there >= 0) || out.n == CORNERS_MOST) continue;
        for (int d = 0; d < 2; d++)
            out.corner[out.n][d] = from[d] + here / (here - there) * (to[d] - from[d]);
        out.n++;
    }
    return out;
}

/* The corners of a face in a plane through a point, counter-clockwise as seen from where its normal points;
 * false where one of them is off the plane. */
static bool flatten(const mesh *m, size_t face, const double at[3], const double normal[3], double distance,
                    bool turned, flat_polygon *out) {
    double u[3], w[3];
    plane_axes(normal, u, w);
    out->n = mesh_corners(m, face);
    for (size_t c = 0; c < out->n; c++) {
        const double *v = m->vertices[m->elements[face][turned ? out->n - 1 - c : c]];
        double off = 0, x = 0, y = 0;
        for (int d = 0; d < 3; d++) {
            off += (v[d] - at[d]) * normal[d];
            x += (v[d] - at[d]) * u[d];
            y += (v[d] - at[d]) * w[d];
        }
        if (!(fabs(off) <= distance)) return false;
        out->corner[c][0] = x;
        out->corner[c][1] = y;
    }
    return true;
}

/* True if the second polygon has the corners of the first, from any of them on. */
static bool same_corners(const flat_polygon *a, const flat_polygon *b, double distance) {
    if (a->n != b->n) return false;
    for (size_t shift = 0; shift < a->n; shift++) {
        size_t k = 0;
        while (k < a->n && plane_distance(a->corner[k], b->corner[(k + shift) % b->n]) <= distance) k++;
        if (k == a->n) return true;
    }
    return false;
}

static double perimeter(const flat_polygon *p) {
    double sum = 0;
    for (size_t k = 0; k < p->n; k++) sum += plane_distance(p->corner[k], p->corner[(k + 1) % p->n]);
    return sum;
}

/* Notes two faces where they overlap. */
static lam_status look(search *s, uint32_t i, uint32_t j) {
    const mesh *m = s->m;
    const float *p = m->normal[i], *q = m->normal[j];
    const double cosine =
        (double)p[0] * (double)q[0] + (double)p[1] * (double)q[1] + (double)p[2] * (double)q[2];
    element_face plane;
    flat_polygon large, small;
    if (cosine < alike && !(s->both_sides && cosine < -alike)) return LAM_OK;
    const bool swapped = m->area[j] > m->area[i];
    const uint32_t a = swapped ? j : i, b = swapped ? i : j;
    if (!element_face_set(m, m->elements[a], &plane)) return LAM_OK;
    /* The larger face gives the plane. A quad may deviate from its own by a hundred-thousandth. */
    if (!flatten(m, b, plane.centre, plane.normal, s->distance, cosine < 0, &small)) return LAM_OK;
    (void)flatten(m, a, plane.centre, plane.normal, HUGE_VAL, false, &large);
    /* Rounding moves the edge that neighbours share by `distance`, and makes them share a strip beside it. */
    const double least = shared_least * m->area[b] + s->distance * perimeter(&small);
    flat_polygon both = small;
    for (size_t k = 0; k < large.n && both.n >= 3; k++)
        both = clip(&both, large.corner[k], large.corner[(k + 1) % large.n]);
    const double area = both.n >= 3 ? fmin(flat_area(&both), m->area[b]) : 0;
    if (!(area > least)) return LAM_OK;
    coincident_pairs *out = s->out;
    const double near = fmin(s->distance, 1e-2 * sqrt(m->area[b]));
    if (array_grow(&out->pairs, &out->capacity, out->n + 1, sizeof *out->pairs, "overlapping faces",
                   s->error) != LAM_OK)
        return LAM_ERR_MEMORY;
    out->pairs[out->n++] =
        (coincident_pair){i < j ? i : j, i < j ? j : i, same_corners(&large, &small, near), area};
    return LAM_OK;
}

static bool may_look(search *s) {
    s->out->cut = s->out->cut || !(s->looks-- > 0);
    return !s->out->cut;
}

/* Faces of a leaf with those of another, or of itself. */
static lam_status look_between(search *s, range a, range b) {
    lam_status status = LAM_OK;
    for (size_t k = a.first; k < a.last; k++)
        for (size_t l = a.node == b.node ? k + 1 : b.first; l < b.last; l++)
            if (boxes_share(&s->faces[k], &s->faces[l], (float)s->distance) && may_look(s))
                TRY(look(s, s->order[k], s->order[l]));
done:
    return status;
}

/* Both ranges differ. */
static lam_status find_between(search *s, range a, range b) {
    lam_status status = LAM_OK;
    if (!boxes_share(&s->nodes[a.node], &s->nodes[b.node], (float)s->distance) || !may_look(s)) return LAM_OK;
    if (is_leaf(a) && is_leaf(b)) return look_between(s, a, b);
    const bool divides_a = !is_leaf(a) && (is_leaf(b) || a.last - a.first >= b.last - b.first);
    for (int c = 0; c < 2; c++)
        TRY(divides_a ? find_between(s, child(a, c), b) : find_between(s, a, child(b, c)));
done:
    return status;
}

static lam_status find_within(search *s, range r) {
    lam_status status = LAM_OK;
    if (is_leaf(r)) return look_between(s, r, r);
    for (int c = 0; c < 2; c++) TRY(find_within(s, child(r, c)));
    TRY(find_between(s, child(r, 0), child(r, 1)));
done:
    return status;
}

lam_status coincident_pairs_find(const mesh *m, bool both_sides, coincident_pairs *out, lam_error *error) {
    lam_status status = LAM_OK;
    coincident_pairs found = {.n = 0};
    search s = {.m = m,
                .both_sides = both_sides,
                .distance = coincident_distance(m),
                .looks = looks_of_all + looks_of_face * (double)m->n,
                .out = &found,
                .error = error};
    double radius;
    const range all = {0, 0, m->n};
    size_t leaves = 1; /* of a tree that is as deep everywhere */
    while (leaves * LEAF < m->n) leaves *= 2;
    s.order = memory_allocate(m->n, sizeof *s.order, "overlapping faces", error);
    s.faces = memory_allocate(m->n, sizeof *s.faces, "overlapping faces", error);
    s.nodes = memory_allocate(2 * leaves, sizeof *s.nodes, "overlapping faces", error);
    if (s.order == NULL || s.faces == NULL || s.nodes == NULL) TRY(LAM_ERR_MEMORY);
    mesh_bounds(m, s.centre, &radius);
    TRY(mesh_z_order(m, s.order, error));
    TRY(sort_by_size(&s));
    make_boxes(&s, all);
    TRY(find_within(&s, all));
    *out = found;
    found = (coincident_pairs){.n = 0};
done:
    free(s.order);
    free(s.faces);
    free(s.nodes);
    free(found.pairs);
    return status;
}
