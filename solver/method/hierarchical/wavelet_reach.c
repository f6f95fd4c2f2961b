#include "solver/method/hierarchical/wavelet_reach.h"

#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LINEAR = 3 };

/* Bounds all elements of a node. */
typedef struct sphere {
    double centre[3], radius;
} sphere;
/* Spheres are enlarged by this before they are rounded to single precision, so that nested ones stay nested.
 */
static const double margin = 1 + 1e-5;

void wavelet_reach_free(wavelet_reach *r) {
    free(r->height);
    free(r->extent);
    free(r->affine);
    free(r->place);
    *r = (wavelet_reach){.n_leaves = 0};
}

/* The bounding sphere of a node: about the midpoint of its children's centres, or, for a leaf, about the mean
 * centre of its elements, each taken as a disk of its area (.318 = 1 / pi). */
static void bounding_sphere(const wavelets *w, const plane_tree *tree, size_t t, const double *area,
                            const double (*centre)[3], sphere *around) {
    const wavelet_node *a = &w->nodes[t];
    sphere *own = &around[t];
    *own = (sphere){.radius = 0};
    if (a->from_left > 0) {
        const sphere *parts[2] = {&around[a->left], &around[t - 1]};
        for (int d = 0; d < 3; d++) own->centre[d] = .5 * (parts[0]->centre[d] + parts[1]->centre[d]);
        for (int k = 0; k < 2; k++) {
            double apart = 0;
            for (int d = 0; d < 3; d++) apart += pow(own->centre[d] - parts[k]->centre[d], 2);
            own->radius = fmax(own->radius, sqrt(apart) + parts[k]->radius);
        }
        return;
    }
    const uint32_t *elements = tree->order + a->begin;
    for (size_t k = 0; k < a->n_elements; k++)
        for (int d = 0; d < 3; d++) own->centre[d] += centre[elements[k]][d] / (double)a->n_elements;
    for (size_t k = 0; k < a->n_elements; k++) {
        double apart = 0;
        for (int d = 0; d < 3; d++) apart += pow(own->centre[d] - centre[elements[k]][d], 2);
        own->radius = fmax(own->radius, sqrt(apart) + sqrt(.318 * area[elements[k]]));
    }
}

static wavelet_extent extent_of(const sphere *s, const wavelet_node *a, uint32_t height, double radii) {
    wavelet_extent made = {.radius = (float)(margin * s->radius),
                           .reach = (float)(margin * (1 + radii) * s->radius),
                           .height = height,
                           .left = a->from_left > 0 ? a->left : WAVELET_NONE,
                           .end = a->begin + a->n_elements};
    for (int d = 0; d < 3; d++) made.centre[d] = (float)s->centre[d];
    return made;
}

/* Products of each scaling function with A^1/2, A^1/2 u, A^1/2 v. */
typedef struct products {
    double of[LINEAR][LINEAR];
} products;

static void place_element(const plane_frame *f, double area, const double *centre, double at[2],
                          wavelet_place *out) {
    at[0] = at[1] = 0;
    for (int axis = 0; f != NULL && axis < 2; axis++)
        for (int d = 0; d < 3; d++) at[axis] += f->axis[axis][d] * (centre[d] - f->origin[d]);
    *out = (wavelet_place){(float)sqrt(area), (float)at[0], (float)at[1]};
}

/* b = G^-1 b for a symmetric G [m][m], m <= 3, by Gauss-Jordan elimination; G is overwritten. */
static void solve(size_t m, double G[LINEAR][LINEAR], double b[LINEAR][LINEAR]) {
    for (size_t k = 0; k < m; k++)
        for (size_t i = 0; i < m; i++) {
            if (i == k) continue;
            const double by = G[i][k] / G[k][k];
            for (size_t j = 0; j < m; j++) G[i][j] -= by * G[k][j];
            for (size_t j = 0; j < LINEAR; j++) b[i][j] -= by * b[k][j];
        }
    for (size_t k = 0; k < m; k++)
        for (size_t j = 0; j < LINEAR; j++) b[k][j] /= G[k][k];
}

/* Coefficients C of the scaling functions Phi = C (1, u, v), u and v about the node's centroid in units of
 * its size. With M = <Phi, (1, u, v)> orthonormality is C M^T = I, so that C = (M M^T)^-1 M. */
static wavelet_affine affine_of(size_t scaling, const products *P, bool linear) {
    double whole = 0, middle[2] = {0, 0}, size = 0, M[LINEAR][LINEAR], G[LINEAR][LINEAR];
    wavelet_affine made = {.u = 0};
    for (size_t k = 0; k < scaling; k++) {
        whole += P->of[k][0] * P->of[k][0];
        for (int axis = 0; axis < 2; axis++) middle[axis] += P->of[k][0] * P->of[k][1 + axis];
    }
    for (int axis = 0; axis < 2; axis++) middle[axis] = linear ? middle[axis] / whole : 0;
    for (size_t k = 0; k < scaling; k++)
        for (int f = 0; f < LINEAR; f++) {
            M[k][f] = f == 0 ? P->of[k][0] : linear ? P->of[k][f] - middle[f - 1] * P->of[k][0] : 0;
            if (f > 0) size += M[k][f] * M[k][f];
        }
    size = size > 0 ? sqrt(size / whole) : 1;
    for (size_t k = 0; k < scaling; k++)
        for (int f = 1; f < LINEAR; f++) M[k][f] /= size;
    for (size_t k = 0; k < scaling; k++)
        for (size_t l = 0; l < scaling; l++) {
            G[k][l] = 0;
            for (int f = 0; f < LINEAR; f++) G[k][l] += M[k][f] * M[l][f];
        }
    solve(scaling, G, M);
    for (size_t k = 0; k < scaling; k++)
        for (int f = 0; f < LINEAR; f++) made.of[k][f] = (float)(f == 0 ? M[k][f] : M[k][f] / size);
    made.u = (float)middle[0];
    made.v = (float)middle[1];
    return made;
}

/* Products of the scaling functions of a node from those of its inputs: P = Q P_inputs. */
static void transform_products(const wavelets *w, size_t t, const products *inputs_of,
                               const double (*leaf)[LINEAR], products *out) {
    const wavelet_node *a = &w->nodes[t];
    const float *columns = wavelet_columns(w, a);
    for (size_t k = 0; k < a->scaling; k++)
        for (size_t f = 0; f < LINEAR; f++) {
            out->of[k][f] = 0;
            for (size_t m = 0; m < a->inputs; m++) {
                const double x = leaf != NULL       ? leaf[m][f]
                                 : m < a->from_left ? inputs_of[a->left].of[m][f]
                                                    : inputs_of[t - 1].of[m - a->from_left][f];
                out->of[k][f] += (double)columns[m * WAVELET_INPUTS + k] * x;
            }
        }
}

lam_status wavelet_reach_make(const wavelets *basis, const plane_tree *tree, const double *area,
                              const double (*centre)[3], double radii, wavelet_reach *out, lam_error *error) {
    lam_status status = LAM_OK;
    const wavelets *w = basis;
    wavelet_reach r = {.basis = basis};
    sphere *around = memory_allocate(w->n_nodes, sizeof *around, "wavelets", error);
    products *P = memory_allocate(w->n_nodes, sizeof *P, "wavelets", error);
    r.height = memory_allocate(w->n_nodes, sizeof *r.height, "wavelets", error);
    r.extent = memory_allocate(w->n_nodes, sizeof *r.extent, "wavelets", error);
    r.affine = memory_allocate(w->n_nodes, sizeof *r.affine, "wavelets", error);
    r.place = memory_allocate(w->n, sizeof *r.place, "wavelets", error);
    if (P == NULL || around == NULL || r.height == NULL || r.extent == NULL || r.affine == NULL ||
        r.place == NULL)
        TRY(LAM_ERR_MEMORY);
    wavelets_heights(w, r.height);
    for (size_t t = 0; t < w->n_nodes; t++) {
        const wavelet_node *a = &w->nodes[t];
        const uint32_t frame = tree->clusters[t].frame;
        double leaf[WAVELET_INPUTS][LINEAR];
        if (a->scaling > LINEAR)
            FAIL(error, LAM_ERR_ARGUMENT, "node %zu has %u scaling functions, must have at most %d", t,
                 (unsigned)a->scaling, LINEAR);
        bounding_sphere(w, tree, t, area, centre, around);
        if (a->from_left == 0) {
            r.n_leaves++;
            for (size_t k = 0; k < a->n_elements; k++) {
                const uint32_t i = tree->order[a->begin + k];
                double at[2];
                place_element(frame == PLANE_ABOVE ? NULL : &tree->frames[frame], area[i], centre[i], at,
                              &r.place[a->begin + k]);
                leaf[k][0] = sqrt(area[i]);
                for (int axis = 0; axis < 2; axis++) leaf[k][1 + axis] = leaf[k][0] * at[axis];
            }
        }
        r.extent[t] = extent_of(&around[t], a, r.height[t], frame == PLANE_ABOVE ? INFINITY : radii);
        /* No closed form holds for functions of one of its children alone: it is near everything. */
        if (tree->clusters[t].apart) r.extent[t].radius = INFINITY;
        transform_products(w, t, P, a->from_left == 0 ? (const double(*)[LINEAR])leaf : NULL, &P[t]);
        r.affine[t] = affine_of(a->scaling, &P[t], frame != PLANE_ABOVE);
    }
    *out = r;
    r = (wavelet_reach){.n_leaves = 0};
done:
    free(around);
    free(P);
    wavelet_reach_free(&r);
    return status;
}

size_t wavelet_cells(const wavelet_reach *r, size_t leaf, const uint32_t *lit, size_t n_lit, uint32_t *out,
                     uint32_t *work) {
    const wavelet_node *nodes = r->basis->nodes;
    const uint32_t root = (uint32_t)r->basis->n_nodes - 1, top = r->height[root];
    uint32_t *const above = work, *const waiting =
                                      work + top + 1; /* above[h]: ancestor of height <= h; waiting: stack */
    size_t found = 0, n_waiting = 0, next = 0;
    uint32_t a = (uint32_t)leaf;
    for (uint32_t h = 0; h <= top; h++) {
        while (nodes[a].parent != WAVELET_NONE && r->height[nodes[a].parent] <= h) a = nodes[a].parent;
        above[h] = a;
    }
    waiting[n_waiting++] = root;
    /* Nodes come in the order of their positions, so that lit[next] is the first that none before held. */
    while (n_waiting > 0 && next < n_lit) {
        const uint32_t b = waiting[--n_waiting];
        const wavelet_extent *e = &r->extent[b];
        if (lit[next] >= e->end) continue;
        if (e->left == WAVELET_NONE || !wavelet_is_near(r, above[e->height], b)) {
            out[found++] = b;
            while (next < n_lit && lit[next] < e->end) next++;
            continue;
        }
        __builtin_prefetch(&r->extent[b - 1]);
        waiting[n_waiting++] = b - 1;
        waiting[n_waiting++] = e->left;
    }
    return found;
}
