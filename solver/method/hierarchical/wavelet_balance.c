#include "solver/method/hierarchical/wavelet_balance.h"

#include "solver/operator/wavelet/wavelet_plan.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* W x of all coefficients. */
static lam_status turn(const wavelets *w, const float *x, float *c, lam_error *error) {
    lam_status status = LAM_OK;
    wavelet_plan plan = {0};
    bool *used = memory_allocate(w->n, sizeof *used, "wavelets", error);
    float *work = NULL;
    if (used == NULL) TRY(LAM_ERR_MEMORY);
    memset(used, true, w->n * sizeof *used);
    TRY(wavelet_plan_create(w, used, &plan, error));
    work = memory_allocate(wavelet_plan_work(&plan), sizeof *work, "wavelets", error);
    if (work == NULL) TRY(LAM_ERR_MEMORY);
    wavelet_plan_forward(&plan, 1, x, c, work, 1);
done:
    wavelet_plan_free(&plan);
    free(used);
    free(work);
    return status;
}

lam_status wavelet_balance(const wavelets *w, const uint32_t *order, const double *area,
                           const double *row_sums, float threshold, const float *weight, csr *S,
                           lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = w->n;
    const wavelet_node *root = &w->nodes[w->n_nodes - 1];
    double length = 0;
    csr made = {.n = n};
    float *x = NULL, *y = NULL;
    if (root->scaling != 1) goto done;
    x = memory_allocate(n, sizeof *x, "wavelets", error);
    y = memory_allocate(n, sizeof *y, "wavelets", error);
    made.indptr = memory_allocate(n + 1, sizeof *made.indptr, "wavelets", error);
    if (x == NULL || y == NULL || made.indptr == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t p = 0; p < n; p++) length += area[p];
    for (size_t p = 0; p < n; p++) x[p] = (float)(sqrt(area[p] / length) * row_sums[order[p]]);
    TRY(turn(w, x, y, error));
    for (size_t t = 0; t < w->n_nodes; t++) {
        const wavelet_node *a = &w->nodes[t];
        const float least = threshold * weight[t] * weight[w->n_nodes - 1];
        for (size_t k = 0; k < a->inputs - a->scaling; k++)
            if (!(fabsf(y[a->first + k]) > least)) y[a->first + k] = 0;
    }
    /* Every row ends in the last column, or does not reach it. */
    for (size_t i = 0; i < n; i++) {
        uint64_t end = S->indptr[i + 1];
        if (end > S->indptr[i] && S->indices[end - 1] == n - 1) end--;
        made.indptr[i + 1] = made.indptr[i] + (end - S->indptr[i]) + (y[i] != 0);
    }
    TRY(csr_reserve(&made, made.indptr[n], error));
    for (size_t i = 0; i < n; i++) {
        const uint64_t to = made.indptr[i], last = made.indptr[i + 1], count = last - to - (y[i] != 0);
        if (count > 0) memcpy(made.indices + to, S->indices + S->indptr[i], count * sizeof *made.indices);
        if (count > 0) memcpy(made.data + to, S->data + S->indptr[i], count * sizeof *made.data);
        if (y[i] == 0) continue;
        made.indices[last - 1] = (uint32_t)(n - 1);
        made.data[last - 1] = y[i];
    }
    csr_free(S);
    *S = made;
    made = (csr){.n = 0};
done:
    free(x);
    free(y);
    csr_free(&made);
    return status;
}
