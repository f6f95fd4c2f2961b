#include "solver/method/hierarchical/compress_bound.h"

#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The least share of a class, over the largest share. */
static const double share_least = 1e-3;

static const double margin = 1 + 1e-9;

/* values [n][WAVELET_SCALING]: the scaling functions at each position over A^1/2; those of the children
 * become those of node t. */
static void size_node(const wavelets *w, size_t t, const double *area, const uint32_t *order,
                      double (*values)[WAVELET_SCALING], node_sizes *out) {
    const wavelet_node *a = &w->nodes[t];
    const bool root = t + 1 == w->n_nodes;
    const float *columns = wavelet_columns(w, &w->nodes[t]);
    const size_t right = a->from_left > 0 ? w->nodes[t - 1].begin : 0;
    for (size_t p = a->begin; p < a->begin + a->n_elements; p++) {
        double in[WAVELET_INPUTS] = {0}, all = 0, own = 0;
        size_t first = 0, count = 1;
        if (a->from_left == 0) {
            first = p - a->begin;
            in[0] = 1 / sqrt(area[order[p]]);
        } else {
            first = p < right ? 0 : a->from_left;
            count = p < right ? a->from_left : a->inputs - a->from_left;
            memcpy(in, values[p], count * sizeof *in);
        }
        for (size_t m = 0; m < count; m++) all += in[m] * in[m];
        for (size_t k = 0; k < a->inputs; k++) {
            double value = 0;
            for (size_t m = 0; m < count; m++)
                value += (double)columns[(first + m) * WAVELET_INPUTS + k] * in[m];
            if (k >= a->scaling || root) own += value * value;
            if (k < a->scaling) values[p][k] = value;
        }
        out->wavelets = fmax(out->wavelets, sqrt(own));
        out->inputs = fmax(out->inputs, sqrt(all));
    }
}

/* Frobenius norm of A_i^1/2 F_ij A_j^-1/2 over the elements of a leaf. */
static double rows_of_leaf(const csr *F, const double *area, const wavelet_node *a, const uint32_t *order) {
    double squares = 0;
    for (size_t p = a->begin; p < a->begin + a->n_elements; p++) {
        const size_t i = order[p];
        for (uint64_t e = F->indptr[i]; e < F->indptr[i + 1]; e++)
            squares += area[i] / area[F->indices[e]] * (double)F->data[e] * (double)F->data[e];
    }
    return sqrt(squares);
}

lam_status compress_sizes(const csr *F, const double *area, const compressed_factors *c, node_sizes *out,
                          lam_error *error) {
    const wavelets *w = &c->basis;
    double(*values)[WAVELET_SCALING] = memory_allocate(w->n, sizeof *values, "form factors", error);
    if (values == NULL) return LAM_ERR_MEMORY;
    for (size_t t = 0; t < w->n_nodes; t++) {
        const wavelet_node *a = &w->nodes[t];
        out[t] = (node_sizes){.rows = 0};
        size_node(w, t, area, c->order, values, &out[t]);
        out[t].rows =
            a->from_left > 0 ? hypot(out[a->left].rows, out[t - 1].rows) : rows_of_leaf(F, area, a, c->order);
    }
    free(values);
    return LAM_OK;
}

/* Chooses groups by descending area, emitters before all others. */
static lam_status choose_lit(const double *area, const uint32_t *group, size_t n_groups, const bool *shines,
                             compressed_factors *c, lam_error *error) {
    lam_status status = LAM_OK;
    double *size = memory_allocate(n_groups, sizeof *size, "form factors", error);
    double whole = 0;
    c->lit_group = memory_allocate(COMPRESS_LIT_MOST, sizeof *c->lit_group, "form factors", error);
    if (size == NULL || c->lit_group == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < c->n; i++) {
        size[group[i]] += area[i];
        whole += area[i];
    }
    for (size_t g = 0; g < n_groups; g++)
        if (size[g] > 0 && shines != NULL && shines[g]) size[g] += whole;
    while (c->n_lit < COMPRESS_LIT_MOST) {
        size_t largest = 0;
        for (size_t g = 1; g < n_groups; g++)
            if (size[g] > size[largest]) largest = g;
        if (n_groups == 0 || !(size[largest] > 0)) break;
        size[largest] = 0;
        c->lit_group[c->n_lit++] = (uint32_t)largest;
    }
done:
    free(size);
    return status;
}

lam_status compress_light_groups(const csr *F, const double *area, const uint32_t *group, size_t n_groups,
                                 const bool *shines, compressed_factors *c, lam_error *error) {
    lam_status status = LAM_OK;
    uint32_t *slot = memory_allocate(n_groups, sizeof *slot, "form factors", error);
    TRY(choose_lit(area, group, n_groups, shines, c, error));
    c->lit = memory_allocate(c->n_lit, c->n * sizeof *c->lit, "form factors", error);
    if (slot == NULL || c->lit == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t g = 0; g < n_groups; g++) slot[g] = UINT32_MAX;
    for (size_t g = 0; g < c->n_lit; g++) slot[c->lit_group[g]] = (uint32_t)g;
    for (size_t i = 0; i < c->n; i++) {
        double sums[COMPRESS_LIT_MOST] = {0};
        for (uint64_t e = F->indptr[i]; e < F->indptr[i + 1]; e++) {
            const uint32_t g = slot[group[F->indices[e]]];
            if (g != UINT32_MAX) sums[g] += (double)F->data[e];
        }
        for (size_t g = 0; g < c->n_lit; g++) c->lit[g * c->n + i] = (float)sums[g];
    }
done:
    free(slot);
    return status;
}

lam_status compress_shares(const double *area, const compressed_factors *c, double *share, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = c->n, K = c->n_classes;
    double *x = memory_allocate(n, sizeof *x, "form factors", error);
    double *work = memory_allocate(compressed_work(c), sizeof *work, "form factors", error);
    double norms[COMPRESSED_CLASSES_MOST], most = 0;
    if (x == NULL || work == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < K; k++) share[k] = 0;
    for (size_t g = 0; g < c->n_lit; g++) {
        double all = 0;
        for (size_t i = 0; i < n; i++) {
            x[i] = (double)c->lit[g * n + i];
            all += area[i] * x[i] * x[i];
        }
        compressed_norms(c, x, norms, work);
        for (size_t k = 0; k < K && all > 0; k++) share[k] += norms[k] * norms[k] / all;
    }
    for (size_t k = 0; k < K; k++) {
        share[k] = sqrt(share[k] / (double)(c->n_lit > 0 ? c->n_lit : 1));
        most = fmax(most, share[k]);
    }
    for (size_t k = 0; k < K; k++) share[k] = most > 0 ? fmax(share[k], share_least * most) : 1;
done:
    free(x);
    free(work);
    return status;
}

/* max over shapes of |Q Q^T - 1|_F, which rounding to single precision leaves above 0. */
static double unorthogonal(const wavelets *w) {
    const float *Q = w->basis;
    double largest = 0;
    for (size_t s = 0; s < w->n_shapes; s++) {
        const size_t m = w->shapes[s].inputs;
        double squares = 0;
        for (size_t i = 0; i < m; i++)
            for (size_t j = 0; j < m; j++) {
                double sum = i == j ? -1 : 0;
                for (size_t k = 0; k < m; k++) sum += (double)Q[i * m + k] * (double)Q[j * m + k];
                squares += sum * sum;
            }
        largest = fmax(largest, sqrt(squares));
        Q += m * m;
    }
    return largest;
}

static float rounded_up(double value) {
    const float near = (float)value;
    return (double)near < value ? nextafterf(near, INFINITY) : near;
}

/* bound_tk = M_t d_tk + rounding, M_t the size of the node's wavelets, d_tk the norm of its dropped
 * coefficients in class k. W^T W differs from 1 by eta a level: forward this is eta of each node's inputs,
 * backward eta of all levels in the radiosity that the rows of a leaf multiply. */
lam_status compress_bounds(const node_sizes *sizes, const double *lost, compressed_factors *c,
                           lam_error *error) {
    const wavelets *w = &c->basis;
    const size_t K = c->n_classes;
    const double eta = unorthogonal(w), levels = (double)K + 1;
    c->bound = memory_allocate(w->n_nodes, K * sizeof *c->bound, "form factors", error);
    if (c->bound == NULL) return LAM_ERR_MEMORY;
    for (size_t t = 0; t < w->n_nodes; t++) {
        const node_sizes *own = &sizes[t];
        const bool leaf = w->nodes[t].from_left == 0;
        const double rounding = own->rows * (own->wavelets * COMPRESS_ASYMMETRY +
                                             own->inputs * (leaf ? (1 + levels) * eta : eta));
        for (size_t k = 0; k < K; k++)
            c->bound[t * K + k] = rounded_up(margin * (own->wavelets * sqrt(lost[t * K + k]) + rounding));
    }
    return LAM_OK;
}
