#include "solver/method/hierarchical/wavelet_basis.h"

#include "solver/base/array_grow.h"
#include "solver/base/union_find.h"
#include "solver/linalg/csr_parts.h"

#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

lam_status wavelet_tree_make(size_t n, const csr *F, const uint32_t *part, const double (*centre)[3],
                             const float (*normal)[3], const element_corners *corners, plane_tree *out,
                             lam_error *error) {
    lam_status status = LAM_OK;
    size_t n_parts = 0;
    uint32_t *joined = NULL, *sizes = NULL;
    if (F != NULL) {
        joined = memory_allocate(n, sizeof *joined, "clusters", error);
        sizes = memory_allocate(n, sizeof *sizes, "clusters", error);
        if (joined == NULL || sizes == NULL) TRY(LAM_ERR_MEMORY);
        csr_parts(F, joined, &n_parts);
        union_find_mark_alone(joined, n, n_parts, sizes);
    }
    /* One part has the order of a tree that knows of none. */
    TRY(plane_tree_make(n, centre, normal, corners,
                        F == NULL     ? part
                        : n_parts > 1 ? joined
                                      : NULL,
                        PLANE_LEAF, out, error));
done:
    free(joined);
    free(sizes);
    return status;
}

/* Moments of a function: its products with A^1/2 times 1, u, v, u^2, uv, v^2, u and v being coordinates in
 * the plane. */
enum { MOMENTS = 6, LINEAR = 3 };

/* A function is linearly dependent on others if less than this share of the constant's norm is left of it
 * after orthogonalization. Its own norm is no measure: of elements in one row it is a rounding error. */
static const double dependent = 1e-5;
/* Nodes whose matrices differ by less in every entry share one. */
static const double same_entry = 1e-5;

typedef struct square {
    double at[WAVELET_INPUTS][WAVELET_INPUTS];
} square;

typedef struct moments {
    double of[WAVELET_INPUTS][MOMENTS];
} moments;

/* out: the moments about the centroid of the inputs, in units of their radius of gyration. */
static void centre_moments(size_t inputs, const moments *M, moments *out) {
    double whole = 0, u = 0, v = 0, size = 0;
    for (size_t k = 0; k < inputs; k++) {
        const double *m = M->of[k];
        whole += m[0] * m[0];
        u += m[0] * m[1];
        v += m[0] * m[2];
        size += m[0] * (m[3] + m[5]);
    }
    u /= whole;
    v /= whole;
    size = sqrt(fmax(size / whole - u * u - v * v, 0));
    const double unit = size > 0 ? 1 / size : 0;
    for (size_t k = 0; k < inputs; k++) {
        const double *m = M->of[k];
        double *to = out->of[k];
        to[0] = m[0];
        to[1] = unit * (m[1] - u * m[0]);
        to[2] = unit * (m[2] - v * m[0]);
        to[3] = unit * unit * (m[3] - 2 * u * m[1] + u * u * m[0]);
        to[4] = unit * unit * (m[4] - u * m[2] - v * m[1] + u * v * m[0]);
        to[5] = unit * unit * (m[5] - 2 * v * m[2] + v * v * m[0]);
    }
}

/* Orthogonalizes x against the first rows of Q, twice because of rounding, and returns the norm that is left.
 */
static double make_orthogonal(size_t inputs, size_t rows, const square *Q, double *x) {
    double length = 0;
    for (int again = 0; again < 2; again++)
        for (size_t k = 0; k < rows; k++) {
            double along = 0;
            for (size_t j = 0; j < inputs; j++) along += Q->at[k][j] * x[j];
            for (size_t j = 0; j < inputs; j++) x[j] -= along * Q->at[k][j];
        }
    for (size_t j = 0; j < inputs; j++) length += x[j] * x[j];
    return sqrt(length);
}

/* Appends x, orthogonalized and normalized, as row `rows` of Q; false if no more than `least` is left of it.
 */
static bool add_row(size_t inputs, size_t rows, const double *x, double least, square *Q) {
    double left[WAVELET_INPUTS];
    memcpy(left, x, inputs * sizeof *left);
    const double rest = make_orthogonal(inputs, rows, Q, left);
    if (!(rest > least)) return false;
    for (size_t j = 0; j < inputs; j++) Q->at[rows][j] = left[j] / rest;
    return true;
}

/* Completes Q to a square: each further row is made of the unit vector of which most is left, the first of
 * equals. left[e] = 1 - sum_k Q_ke^2, the square of what the first rows leave of unit vector e. */
static void complete(size_t inputs, size_t rows, square *Q) {
    double left[WAVELET_INPUTS];
    for (size_t e = 0; e < inputs; e++) {
        left[e] = 1;
        for (size_t k = 0; k < rows; k++) left[e] -= Q->at[k][e] * Q->at[k][e];
    }
    for (; rows < inputs; rows++) {
        double most = 0, unit[WAVELET_INPUTS] = {0};
        size_t first = 0;
        for (size_t e = 0; e < inputs; e++) most = left[e] > most ? left[e] : most;
        while (first + 1 < inputs && !(left[first] > .998 * most)) first++;
        unit[first] = 1;
        const double rest = make_orthogonal(inputs, rows, Q, unit);
        for (size_t e = 0; e < inputs; e++) {
            Q->at[rows][e] = unit[e] / rest;
            left[e] -= Q->at[rows][e] * Q->at[rows][e];
        }
    }
}

/* The matrix Q of a node, its scaling functions first. The wavelets are orthogonal to the scaling functions
 * and, as far as there are enough inputs, one after the other to the quadratic functions. Returns the number
 * of scaling functions. */
static size_t make_square(size_t inputs, const moments *M, bool linear, square *Q) {
    moments about;
    size_t rows = 0, scaling = 0;
    double constant = 0;
    for (size_t j = 0; j < inputs; j++) constant += M->of[j][0] * M->of[j][0];
    if (linear) {
        centre_moments(inputs, M, &about);
    } else {
        about = *M;
    }
    for (size_t f = 0; f < (linear ? (size_t)MOMENTS : 1) && rows < inputs; f++) {
        double x[WAVELET_INPUTS];
        for (size_t j = 0; j < inputs; j++) x[j] = about.of[j][f];
        rows += add_row(inputs, rows, x, f == 0 ? 0 : dependent * sqrt(constant), Q);
        if (f < LINEAR) scaling = rows;
    }
    complete(inputs, rows, Q);
    return scaling;
}

/* The matrix of a node whose children are apart, a permutation: the constant of the left one is its scaling
 * function, the constant of the right one its last coefficient. */
static void make_apart(size_t inputs, size_t from_left, square *Q) {
    *Q = (square){.at = {{1}}};
    for (size_t row = 1; row + 1 < inputs; row++) Q->at[row][row < from_left ? row : row + 1] = 1;
    Q->at[inputs - 1][from_left] = 1;
}

typedef struct shape_table {
    wavelet_shape *shapes;
    float *basis;
    size_t *begin; /* [count], where the matrix of each begins in basis */
    size_t count, used, capacity, room;
    uint32_t *slots; /* [n_slots] shape + 1, 0: empty */
    size_t n_slots;
} shape_table;

static uint64_t hash_of(const wavelet_shape *s, const square *Q) {
    uint64_t h = s->leaf + 2u * s->inputs + 32u * s->scaling;
    for (size_t i = 0; i < s->inputs; i++)
        for (size_t j = 0; j < s->inputs; j++) {
            const int64_t rounded = (int64_t)floor(Q->at[i][j] * 1000 + .5);
            h = (h ^ (uint64_t)rounded) * 0x9E3779B97F4A7C15u;
            h ^= h >> 29;
        }
    return h;
}

static bool is_same(const shape_table *t, uint32_t k, const wavelet_shape *s, const square *Q) {
    const wavelet_shape *other = &t->shapes[k];
    const float *basis = t->basis + t->begin[k];
    if (other->leaf != s->leaf || other->inputs != s->inputs || other->scaling != s->scaling) return false;
    for (size_t i = 0; i < s->inputs; i++)
        for (size_t j = 0; j < s->inputs; j++)
            if (fabs((double)basis[i * s->inputs + j] - Q->at[i][j]) > same_entry) return false;
    return true;
}

/* out: the number of a shape, which is added if it is new. */
static lam_status find_shape(shape_table *t, const wavelet_shape *s, const square *Q, uint32_t *out,
                             lam_error *error) {
    lam_status status = LAM_OK;
    size_t slot = hash_of(s, Q) % t->n_slots;
    for (; t->slots[slot] != 0; slot = (slot + 1) % t->n_slots) {
        *out = t->slots[slot] - 1;
        if (is_same(t, *out, s, Q)) goto done;
    }
    const size_t size = (size_t)s->inputs * s->inputs;
    if (t->count == t->capacity) {
        const size_t capacity = array_capacity(t->capacity, t->count + 1);
        TRY(array_resize(&t->shapes, capacity, sizeof *t->shapes, "wavelets", error));
        TRY(array_resize(&t->begin, capacity, sizeof *t->begin, "wavelets", error));
        t->capacity = capacity;
    }
    TRY(array_grow(&t->basis, &t->room, t->used + size, sizeof *t->basis, "wavelets", error));
    t->shapes[t->count] = *s;
    t->begin[t->count] = t->used;
    for (size_t i = 0; i < s->inputs; i++)
        for (size_t j = 0; j < s->inputs; j++) t->basis[t->used++] = (float)Q->at[i][j];
    *out = (uint32_t)t->count++;
    t->slots[slot] = *out + 1;
done:
    return status;
}

static void moments_of_element(const plane_frame *f, double area, const double *centre, double *m) {
    double at[2] = {0, 0};
    for (int axis = 0; axis < 2; axis++)
        for (int d = 0; d < 3; d++) at[axis] += f->axis[axis][d] * (centre[d] - f->origin[d]);
    const double root = sqrt(area);
    const double value[MOMENTS] = {1, at[0], at[1], at[0] * at[0], at[0] * at[1], at[1] * at[1]};
    for (int k = 0; k < MOMENTS; k++) m[k] = root * value[k];
}

/* Moments of the scaling functions of a node. */
typedef struct scaling_moments {
    size_t scaling;
    double of[WAVELET_SCALING][MOMENTS];
} scaling_moments;

/* Inputs of a node and their moments. */
static size_t gather_inputs(const plane_tree *tree, size_t t, const double *area, const double (*centre)[3],
                            const scaling_moments *up, moments *M) {
    const plane_cluster *c = &tree->clusters[t];
    size_t inputs = 0;
    if (c->leaf) {
        for (size_t p = c->begin; p < c->end; p++) {
            const uint32_t i = tree->order[p];
            moments_of_element(&tree->frames[c->frame], area[i], centre[i], M->of[inputs++]);
        }
        return inputs;
    }
    const size_t children[2] = {c->left, t - 1};
    for (int side = 0; side < 2; side++)
        for (size_t k = 0; k < up[children[side]].scaling; k++)
            memcpy(M->of[inputs++], up[children[side]].of[k], sizeof M->of[0]);
    return inputs;
}

lam_status wavelet_basis_make(const plane_tree *tree, const double *area, const double (*centre)[3],
                              wavelets *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t count = tree->n_clusters;
    shape_table table = {.n_slots = 2 * count + 1};
    scaling_moments *up = memory_allocate(count, sizeof *up, "wavelets", error);
    uint32_t *node_shapes = memory_allocate(count, sizeof *node_shapes, "wavelets", error);
    table.slots = memory_allocate(table.n_slots, sizeof *table.slots, "wavelets", error);
    if (up == NULL || node_shapes == NULL || table.slots == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t t = 0; t < count; t++) {
        moments M;
        square Q;
        const bool linear = tree->clusters[t].frame != PLANE_ABOVE;
        const size_t inputs = gather_inputs(tree, t, area, centre, up, &M);
        const bool apart = tree->clusters[t].apart;
        if (apart) make_apart(inputs, up[tree->clusters[t].left].scaling, &Q);
        const size_t scaling = apart ? 1 : make_square(inputs, &M, linear, &Q);
        const wavelet_shape shape = {tree->clusters[t].leaf, (uint32_t)inputs, (uint32_t)scaling};
        TRY(find_shape(&table, &shape, &Q, &node_shapes[t], error));
        up[t].scaling = scaling;
        for (size_t k = 0; k < scaling; k++)
            for (size_t f = 0; f < MOMENTS; f++) {
                up[t].of[k][f] = 0;
                for (size_t j = 0; j < inputs; j++) up[t].of[k][f] += Q.at[k][j] * M.of[j][f];
            }
    }
    wavelet_shape *const shapes = table.shapes;
    float *const basis = table.basis;
    table.shapes = NULL;
    table.basis = NULL;
    TRY(wavelets_create(tree->n, count, node_shapes, table.count, shapes, basis, table.used, out, error));
done:
    free(table.shapes);
    free(table.basis);
    free(table.begin);
    free(table.slots);
    free(up);
    free(node_shapes);
    return status;
}

void wavelet_roots_free(wavelet_roots *r) {
    free(r->of_node);
    free(r->of_coefficient);
    *r = (wavelet_roots){.count = 0};
}

lam_status wavelet_roots_make(const plane_tree *tree, const wavelets *basis, wavelet_roots *out,
                              lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = basis->n, last = basis->n_nodes - 1;
    wavelet_roots r = {.of_node = memory_allocate(basis->n_nodes, sizeof *r.of_node, "wavelets", error),
                       .of_coefficient = memory_allocate(n, sizeof *r.of_coefficient, "wavelets", error),
                       .count = 1};
    if (r.of_node == NULL || r.of_coefficient == NULL) TRY(LAM_ERR_MEMORY);
    r.of_node[last] = basis->nodes[last].scaling == 1 ? (uint32_t)n - 1 : WAVELET_NONE;
    for (size_t k = n - basis->nodes[last].scaling; k < n; k++) r.of_coefficient[k] = r.of_node[last];
    for (size_t t = basis->n_nodes; t-- > 0;) {
        const wavelet_node *a = &basis->nodes[t];
        const uint32_t end = a->first + a->inputs - a->scaling;
        const bool apart = tree->clusters[t].apart;
        const uint32_t root = r.of_node[t], right = apart ? end - 1 : root;
        for (uint32_t k = a->first; k < end; k++)
            r.of_coefficient[k] = k < a->first + a->from_left - apart ? root : right;
        if (a->from_left > 0) {
            r.of_node[a->left] = root;
            r.of_node[t - 1] = right;
        }
        r.count += apart;
    }
    *out = r;
    r = (wavelet_roots){.count = 0};
done:
    wavelet_roots_free(&r);
    return status;
}
