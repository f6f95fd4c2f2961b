#include "solver/scene/box_pairs.h"

#include <math.h>
#include <stdlib.h>

/* Faces in a leaf of the tree of boxes. */
enum { LEAF = 8 };

/* Pairs of boxes or of faces that are looked at: this number for each face, and for all. A scene of n faces
 * that do not overlap takes about 40 n. */
static const double looks_of_face = 1000, looks_of_all = 1e8;

/* About the scene's centre: single precision is off by less than a tenth of the distance of planes. */
typedef struct box {
    float low[3], high[3];
} box;

typedef struct search {
    const mesh *m;
    const box_pairs *how;
    double centre[3], looks;
    bool cut;
    uint32_t *order; /* [n]: faces of one size and place follow each other */
    box *faces;      /* [n], in this order */
    box *nodes;      /* of the tree: the children of node k are 2k + 1 and 2k + 2 */
    lam_error *error;
} search;

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

static inline bool boxes_meet(const box *a, const box *b, float distance, float least, int least_axes) {
    int long_axes = 0;
    for (int d = 0; d < 3; d++) {
        const float length = lower(a->high[d], b->high[d]) - higher(a->low[d], b->low[d]);
        if (length < -distance) return false;
        long_axes += length > least;
    }
    return long_axes >= least_axes;
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
    uint32_t *sorted = memory_allocate(n, sizeof *sorted, "boxes of faces", s->error);
    uint8_t *size = memory_allocate(n, sizeof *size, "boxes of faces", s->error);
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

static inline bool meet(const search *s, const box *a, const box *b) {
    return boxes_meet(a, b, (float)s->how->distance, (float)s->how->least, s->how->long_axes);
}

static bool may_look(search *s) {
    s->cut = s->cut || !(s->looks-- > 0);
    return !s->cut;
}

/* Faces of a leaf with those of another, or of itself. */
static lam_status look_between(search *s, range a, range b) {
    lam_status status = LAM_OK;
    for (size_t k = a.first; k < a.last; k++)
        for (size_t l = a.node == b.node ? k + 1 : b.first; l < b.last; l++)
            if (meet(s, &s->faces[k], &s->faces[l]) && may_look(s))
                TRY(s->how->visit(s->how->context, s->order[k], s->order[l], s->error));
done:
    return status;
}

/* Both ranges differ. */
static lam_status find_between(search *s, range a, range b) {
    lam_status status = LAM_OK;
    if (!meet(s, &s->nodes[a.node], &s->nodes[b.node]) || !may_look(s)) return LAM_OK;
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

lam_status box_pairs_visit(const mesh *m, const box_pairs *how, bool *cut, lam_error *error) {
    lam_status status = LAM_OK;
    search s = {.m = m, .how = how, .looks = looks_of_all + looks_of_face * (double)m->n, .error = error};
    double radius;
    const range all = {0, 0, m->n};
    size_t leaves = 1; /* of a tree that is as deep everywhere */
    *cut = false;
    if (m->n == 0) return LAM_OK;
    while (leaves * LEAF < m->n) leaves *= 2;
    s.order = memory_allocate(m->n, sizeof *s.order, "boxes of faces", error);
    s.faces = memory_allocate(m->n, sizeof *s.faces, "boxes of faces", error);
    s.nodes = memory_allocate(2 * leaves, sizeof *s.nodes, "boxes of faces", error);
    if (s.order == NULL || s.faces == NULL || s.nodes == NULL) TRY(LAM_ERR_MEMORY);
    mesh_bounds(m, s.centre, &radius);
    TRY(mesh_z_order(m, s.order, error));
    TRY(sort_by_size(&s));
    make_boxes(&s, all);
    TRY(find_within(&s, all));
    *cut = s.cut;
done:
    free(s.order);
    free(s.faces);
    free(s.nodes);
    return status;
}
