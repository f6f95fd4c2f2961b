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

/* Leaves out of y [n] the entries but for the root's that are not above threshold weight_i weight_root;
 * those that A has in its last column stay where `kept` is true. */
static void drop_small(const wavelets *w, float threshold, const float *weight, const csr *A, bool kept,
                       double *y) {
    for (size_t t = 0; t < w->n_nodes; t++) {
        const wavelet_node *a = &w->nodes[t];
        const double least = (double)(threshold * weight[t] * weight[w->n_nodes - 1]);
        for (size_t i = a->first; i < a->first + a->inputs - a->scaling; i++) {
            const uint64_t end = A->indptr[i + 1];
            const bool has = end > A->indptr[i] && A->indices[end - 1] == A->n - 1;
            if (!(kept && has) && !(fabs(y[i]) > least)) y[i] = 0;
        }
    }
}

/* Replaces the last column of the upper triangle by y [n] without its zeros. The entry of that column, if a
 * row has it, is the last of the row. */
static lam_status set_last_column(const double *y, csr *A, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = A->n;
    csr made = {.n = n, .indptr = memory_allocate(n + 1, sizeof *made.indptr, "wavelets", error)};
    if (made.indptr == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) {
        uint64_t end = A->indptr[i + 1];
        if (end > A->indptr[i] && A->indices[end - 1] == n - 1) end--;
        made.indptr[i + 1] = made.indptr[i] + (end - A->indptr[i]) + (y[i] != 0);
    }
    TRY(csr_reserve(&made, made.indptr[n], error));
    for (size_t i = 0; i < n; i++) {
        const uint64_t to = made.indptr[i], last = made.indptr[i + 1], count = last - to - (y[i] != 0);
        if (count > 0) memcpy(made.indices + to, A->indices + A->indptr[i], count * sizeof *made.indices);
        if (count > 0) memcpy(made.data + to, A->data + A->indptr[i], count * sizeof *made.data);
        if (y[i] == 0) continue;
        made.indices[last - 1] = (uint32_t)(n - 1);
        made.data[last - 1] = (float)y[i];
    }
    csr_free(A);
    *A = made;
    made = (csr){.n = 0};
done:
    csr_free(&made);
    return status;
}

lam_status wavelet_impose_row_sums(const wavelets *w, const uint32_t *order, const double *area,
                                   const double *row_sums, float threshold, const float *weight, csr *S,
                                   lam_error *error) {
    lam_status status = LAM_OK;
    double length = 0, *y = NULL;
    if (w->nodes[w->n_nodes - 1].scaling != 1) goto done;
    TRY(transform(w, order, area, row_sums, &y, error));
    for (size_t p = 0; p < w->n; p++) length += area[p];
    for (size_t i = 0; i < w->n; i++) y[i] /= sqrt(length);
    drop_small(w, threshold, weight, S, false, y);
    TRY(set_last_column(y, S, error));
done:
    free(y);
    return status;
}

/* y = v - sum_{j != r} K_ij u_j of the rows i != r, r = n - 1, over u_r. */
static void answer_left(const csr *K, const double *u, double *v) {
    const size_t r = K->n - 1;
    for (size_t i = 0; i < r; i++)
        for (uint64_t e = K->indptr[i]; e < K->indptr[i + 1] && K->indices[e] != r; e++) {
            const uint32_t j = K->indices[e];
            v[i] -= (double)K->data[e] * u[j];
            if (j != i) v[j] -= (double)K->data[e] * u[i];
        }
    for (size_t i = 0; i < r; i++) v[i] /= u[r];
}

lam_status wavelet_impose_answer(const wavelets *w, const uint32_t *order, const double *area,
                                 const double *E, const double *H, float threshold, const float *weight,
                                 csr *K, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t r = w->n - 1;
    double *u = NULL, *y = NULL;
    if (w->nodes[w->n_nodes - 1].scaling != 1) goto done;
    TRY(transform(w, order, area, E, &u, error));
    if (!(u[r] > 0)) goto done;
    TRY(transform(w, order, area, H, &y, error));
    answer_left(K, u, y);
    drop_small(w, threshold, weight, K, true, y);
    for (size_t i = 0; i < r; i++) y[r] -= (double)(float)y[i] * u[i];
    y[r] /= u[r];
    TRY(set_last_column(y, K, error));
done:
    free(u);
    free(y);
    return status;
}
