/* W R W^T, a diagonal matrix R in a wavelet basis. Node t holds G_t = Phi_t R Phi_t^T; with Q_t its matrix,
 *     Q_t diag(G_left, G_right) Q_t^T = [Phi_t; Psi_t] R [Phi_t; Psi_t]^T
 * has the coefficients of its own wavelets and G_t, and Psi_t R Phi_t^T is carried up to those of its
 * ancestors. */
#include "solver/method/hierarchical/wavelet_inverse.h"

#include "solver/base/array_grow.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Smaller entries are rounding errors. */
static const float no_coupling = 1e-6f;

typedef struct entries {
    uint32_t *row, *column;
    float *value;
    size_t used, capacity;
} entries;

static lam_status put(entries *to, size_t i, size_t j, float value, lam_error *error) {
    lam_status status = LAM_OK;
    if (to->used == to->capacity) {
        const size_t capacity = array_capacity(to->capacity, to->used + 1);
        TRY(array_resize(&to->row, capacity, sizeof *to->row, "wavelets", error));
        TRY(array_resize(&to->column, capacity, sizeof *to->column, "wavelets", error));
        TRY(array_resize(&to->value, capacity, sizeof *to->value, "wavelets", error));
        to->capacity = capacity;
    }
    to->row[to->used] = (uint32_t)i;
    to->column[to->used] = (uint32_t)j;
    to->value[to->used++] = value;
done:
    return status;
}

typedef float small[WAVELET_INPUTS][WAVELET_INPUTS];

/* M = Q G Q^T */
static void transform_both(const wavelets *w, const wavelet_node *a, const small G, small M) {
    const float *columns = wavelet_columns(w, a);
    double half[WAVELET_INPUTS][WAVELET_INPUTS] = {{0}};
    for (size_t i = 0; i < a->inputs; i++)
        for (size_t k = 0; k < a->inputs; k++)
            for (size_t m = 0; m < a->inputs; m++)
                half[i][k] += (double)columns[m * WAVELET_INPUTS + i] * (double)G[m][k];
    for (size_t i = 0; i < a->inputs; i++)
        for (size_t j = 0; j < a->inputs; j++) {
            double sum = 0;
            for (size_t m = 0; m < a->inputs; m++)
                sum += half[i][m] * (double)columns[m * WAVELET_INPUTS + j];
            M[i][j] = (float)sum;
        }
}

/* Entries of wavelet i of node t with all ancestors: scaling [t's] is Psi_i R Phi_t^T, which the matrix of
 * each ancestor in turn splits into its wavelets and its scaling functions. */
static lam_status couple_up(const wavelets *w, size_t t, size_t i, const float *scaling, entries *to,
                            lam_error *error) {
    lam_status status = LAM_OK;
    float x[WAVELET_SCALING], y[WAVELET_INPUTS];
    memcpy(x, scaling, w->nodes[t].scaling * sizeof *x);
    for (;;) {
        float most = 0;
        for (size_t k = 0; k < w->nodes[t].scaling; k++) most = fmaxf(most, fabsf(x[k]));
        if (most <= no_coupling) break;
        if (w->nodes[t].parent == WAVELET_NONE) {
            for (size_t k = 0; k < w->nodes[t].scaling; k++)
                TRY(put(to, i, w->n - w->nodes[t].scaling + k, x[k], error));
            break;
        }
        const wavelet_node *a = &w->nodes[w->nodes[t].parent];
        const float *columns = wavelet_columns(w, a);
        const size_t at = a->left == t ? 0 : a->from_left;
        for (size_t k = 0; k < a->inputs; k++) {
            y[k] = 0;
            for (size_t m = 0; m < w->nodes[t].scaling; m++)
                y[k] += columns[(at + m) * WAVELET_INPUTS + k] * x[m];
        }
        for (size_t k = a->scaling; k < a->inputs; k++)
            if (fabsf(y[k]) > no_coupling) TRY(put(to, i, a->first + k - a->scaling, y[k], error));
        memcpy(x, y, a->scaling * sizeof *x);
        t = w->nodes[t].parent;
    }
done:
    return status;
}

/* out: the entries as a CSR matrix; within a row they come with ascending columns. */
static lam_status by_rows(const entries *from, size_t n, csr *out, lam_error *error) {
    lam_status status = LAM_OK;
    csr made = {.n = n, .indptr = memory_allocate(n + 1, sizeof *made.indptr, "wavelets", error)};
    if (made.indptr == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t e = 0; e < from->used; e++) made.indptr[from->row[e] + 1]++;
    TRY(csr_begin_rows(&made, "wavelets", error));
    for (size_t e = 0; e < from->used; e++) {
        const uint64_t to = made.indptr[from->row[e]]++;
        made.indices[to] = from->column[e];
        made.data[to] = from->value[e];
    }
    csr_end_rows(&made);
    *out = made;
    made = (csr){.n = 0};
done:
    csr_free(&made);
    return status;
}

lam_status wavelet_diagonal(const wavelets *w, const float *rho, csr *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t N = w->n_nodes;
    entries found = {.used = 0};
    float(*up)[WAVELET_SCALING][WAVELET_SCALING] = memory_allocate(N, sizeof *up, "wavelets", error);
    if (up == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t t = 0; t < N; t++) {
        const wavelet_node *a = &w->nodes[t];
        small G = {{0}}, M;
        if (a->from_left == 0)
            for (size_t k = 0; k < a->inputs; k++) G[k][k] = rho[a->begin + k];
        for (size_t i = 0; i < a->from_left; i++)
            for (size_t j = 0; j < a->from_left; j++) G[i][j] = up[a->left][i][j];
        for (size_t i = 0; a->from_left > 0 && i < a->inputs - a->from_left; i++)
            for (size_t j = 0; j < a->inputs - a->from_left; j++)
                G[a->from_left + i][a->from_left + j] = up[t - 1][i][j];
        transform_both(w, a, G, M);
        for (size_t i = 0; i < a->scaling; i++)
            for (size_t j = 0; j < a->scaling; j++) up[t][i][j] = M[i][j];
        for (size_t i = a->scaling; i < a->inputs; i++) {
            const size_t at = a->first + i - a->scaling;
            for (size_t j = i; j < a->inputs; j++)
                if (j == i || fabsf(M[i][j]) > no_coupling)
                    TRY(put(&found, at, a->first + j - a->scaling, M[i][j], error));
            TRY(couple_up(w, t, at, M[i], &found, error));
        }
    }
    const size_t scaling = w->nodes[N - 1].scaling, first = w->n - scaling;
    for (size_t i = 0; i < scaling; i++)
        for (size_t j = i; j < scaling; j++) TRY(put(&found, first + i, first + j, up[N - 1][i][j], error));
    TRY(by_rows(&found, w->n, out, error));
done:
    free(up);
    free(found.row);
    free(found.column);
    free(found.value);
    return status;
}
