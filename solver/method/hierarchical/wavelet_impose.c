#include "solver/method/hierarchical/wavelet_impose.h"

#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* c [n] = W A^1/2 x, x by element. */
static lam_status transform(const wavelets *w, const uint32_t *order, const double *area, const double *x,
                            double **out, lam_error *error) {
    lam_status status = LAM_OK;
    double *placed = memory_allocate(w->n, sizeof *placed, "wavelets", error);
    double *c = memory_allocate(w->n, sizeof *c, "wavelets", error);
    double *work = memory_allocate(wavelets_work(w), sizeof *work, "wavelets", error);
    if (placed == NULL || c == NULL || work == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t p = 0; p < w->n; p++) placed[p] = sqrt(area[p]) * x[order[p]];
    wavelets_forward(w, placed, c, work);
    *out = c;
    c = NULL;
done:
    free(placed);
    free(c);
    free(work);
    return status;
}

/* out [n] = the weight of each coefficient. Errors: LAM_ERR_MEMORY. */
static lam_status spread_weights(const wavelets *w, const float *weight, float **out, lam_error *error) {
    float *made = memory_allocate(w->n, sizeof *made, "wavelets", error);
    if (made == NULL) return LAM_ERR_MEMORY;
    for (size_t t = 0; t < w->n_nodes; t++) {
        const wavelet_node *a = &w->nodes[t];
        for (size_t i = a->first; i < a->first + a->inputs - a->scaling; i++) made[i] = weight[t];
    }
    for (size_t i = w->n - w->nodes[w->n_nodes - 1].scaling; i < w->n; i++) made[i] = weight[w->n_nodes - 1];
    *out = made;
    return LAM_OK;
}

/* The entry of row i in column j; NULL: there is none. */
static const float *entry_of(const csr *A, size_t i, uint32_t j) {
    for (uint64_t e = A->indptr[i + 1]; e > A->indptr[i] && A->indices[e - 1] >= j; e--)
        if (A->indices[e - 1] == j) return &A->data[e - 1];
    return NULL;
}

/* Leaves out of y [n] the entries but for the roots' own that are not above threshold weight_i weight_root;
 * those that A has in the columns of its roots stay where `kept` is true. */
static lam_status drop_small(const wavelets *w, const uint32_t *root, float threshold, const float *weight,
                             const csr *A, bool kept, double *y, lam_error *error) {
    float *by = NULL;
    if (spread_weights(w, weight, &by, error) != LAM_OK) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < w->n; i++) {
        const uint32_t r = root[i];
        if (r == WAVELET_NONE || r == i || (kept && entry_of(A, i, r) != NULL)) continue;
        if (!(fabs(y[i]) > (double)(threshold * by[i] * by[r]))) y[i] = 0;
    }
    free(by);
    return LAM_OK;
}

/* Replaces the entries (i, root[i]) of the upper triangle by y [n], zeros left out; rows whose root is
 * WAVELET_NONE stay as they are. */
static lam_status set_columns(const uint32_t *root, const double *y, csr *A, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = A->n;
    csr made = {.n = n, .indptr = memory_allocate(n + 1, sizeof *made.indptr, "wavelets", error)};
    if (made.indptr == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) {
        const bool set = root[i] != WAVELET_NONE;
        made.indptr[i + 1] = made.indptr[i] + (A->indptr[i + 1] - A->indptr[i]) + (set && y[i] != 0) -
                             (set && entry_of(A, i, root[i]) != NULL);
    }
    TRY(csr_reserve(&made, made.indptr[n], error));
    for (size_t i = 0; i < n; i++) {
        const uint32_t r = root[i];
        uint64_t to = made.indptr[i], e = A->indptr[i];
        for (; e < A->indptr[i + 1] && A->indices[e] < r; e++, to++) {
            made.indices[to] = A->indices[e];
            made.data[to] = A->data[e];
        }
        if (r == WAVELET_NONE) continue;
        if (y[i] != 0) {
            made.indices[to] = r;
            made.data[to++] = (float)y[i];
        }
        for (; e < A->indptr[i + 1]; e++) {
            if (A->indices[e] == r) continue;
            made.indices[to] = A->indices[e];
            made.data[to++] = A->data[e];
        }
    }
    csr_free(A);
    *A = made;
    made = (csr){.n = 0};
done:
    csr_free(&made);
    return status;
}

/* v_i -= sum_j A_ij u_j, but for the entry of the root of i. */
static void subtract_others(const csr *A, const uint32_t *root, const double *u, double *v) {
    for (size_t i = 0; i < A->n; i++)
        for (uint64_t e = A->indptr[i]; e < A->indptr[i + 1]; e++) {
            const uint32_t j = A->indices[e];
            if (j == root[i]) continue;
            v[i] -= (double)A->data[e] * u[j];
            if (j != i) v[j] -= (double)A->data[e] * u[i];
        }
}

/* Sets the entries of A in the columns of roots so that A u = v: v [n] is overwritten. Parts in which u_r of
 * the root r is not above 0 stay as they are. */
static lam_status impose(const wavelets *w, const wavelet_roots *roots, const double *u, float threshold,
                         const float *weight, bool kept, double *v, csr *A, lam_error *error) {
    lam_status status = LAM_OK;
    uint32_t *root = memory_allocate(w->n, sizeof *root, "wavelets", error);
    if (root == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < w->n; i++) {
        const uint32_t r = roots->of_coefficient[i];
        root[i] = u[r] > 0 ? r : WAVELET_NONE;
    }
    subtract_others(A, root, u, v);
    for (size_t i = 0; i < w->n; i++)
        if (root[i] != WAVELET_NONE && root[i] != i) v[i] /= u[root[i]];
    TRY(drop_small(w, root, threshold, weight, A, kept, v, error));
    for (size_t i = 0; i < w->n; i++)
        if (root[i] != WAVELET_NONE && root[i] != i) v[root[i]] -= (double)(float)v[i] * u[i];
    for (size_t i = 0; i < w->n; i++)
        if (root[i] == i) v[i] /= u[i];
    TRY(set_columns(root, v, A, error));
done:
    free(root);
    return status;
}

lam_status wavelet_impose_row_sums(const wavelets *w, const wavelet_roots *roots, const uint32_t *order,
                                   const double *area, const double *row_sums, float threshold,
                                   const float *weight, csr *S, lam_error *error) {
    lam_status status = LAM_OK;
    double *v = NULL, *u = memory_allocate(w->n, sizeof *u, "wavelets", error); /* W A^1/2 1 */
    if (u == NULL) return LAM_ERR_MEMORY;
    if (roots->of_coefficient[w->n - 1] == WAVELET_NONE) goto done;
    TRY(transform(w, order, area, row_sums, &v, error));
    for (size_t t = 0; t < w->n_nodes; t++) {
        const wavelet_node *a = &w->nodes[t];
        if (a->from_left > 0) continue;
        for (size_t p = a->begin; p < a->begin + a->n_elements; p++) u[roots->of_node[t]] += area[p];
    }
    for (size_t i = 0; i < w->n; i++) u[i] = sqrt(u[i]);
    TRY(impose(w, roots, u, threshold, weight, false, v, S, error));
done:
    free(u);
    free(v);
    return status;
}

lam_status wavelet_impose_answer(const wavelets *w, const wavelet_roots *roots, const uint32_t *order,
                                 const double *area, const double *E, const double *H, float threshold,
                                 const float *weight, csr *K, lam_error *error) {
    lam_status status = LAM_OK;
    double *u = NULL, *v = NULL;
    if (roots->of_coefficient[w->n - 1] == WAVELET_NONE) goto done;
    TRY(transform(w, order, area, E, &u, error));
    TRY(transform(w, order, area, H, &v, error));
    TRY(impose(w, roots, u, threshold, weight, true, v, K, error));
done:
    free(u);
    free(v);
    return status;
}
