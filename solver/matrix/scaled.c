#include "solver/matrix/scaled.h"

#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

lam_status scaled_init(scaled_matrix *S, const csr *F, const double *area, lam_error *error) {
    double *root = memory_allocate(F->n, sizeof *root, "scaled form factors", error);
    if (root == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < F->n; i++) root[i] = sqrt(area[i]);
    *S = (scaled_matrix){.F = F, .root_area = root};
    return LAM_OK;
}

void scaled_free(scaled_matrix *S) {
    free(S->root_area);
    *S = (scaled_matrix){0};
}

void scaled_columns(const scaled_matrix *S, const uint32_t *columns, size_t m, float *block) {
    const csr *F = S->F;
    const double *root = S->root_area;
#pragma omp parallel for schedule(static, 4)
    for (size_t c = 0; c < m; c++) {
        const size_t e = columns[c];
        float *column = block + c * F->n;
        memset(column, 0, F->n * sizeof *column);
        /* S_je = S_ej = A_e^1/2 F_ej A_j^-1/2 */
        for (uint64_t p = F->indptr[e]; p < F->indptr[e + 1]; p++) {
            const size_t j = F->indices[p];
            column[j] = (float)(root[e] * (double)F->data[p] / root[j]);
        }
    }
}

void scaled_multiply(const scaled_matrix *S, const double *x, double *y) {
    const csr *F = S->F;
    const double *root = S->root_area;
#pragma omp parallel for schedule(static, 64) if (F->n >= 2048)
    for (size_t i = 0; i < F->n; i++) {
        double sum = 0;
        for (uint64_t p = F->indptr[i]; p < F->indptr[i + 1]; p++)
            sum += (double)F->data[p] * x[F->indices[p]] / root[F->indices[p]];
        y[i] = root[i] * sum;
    }
}
