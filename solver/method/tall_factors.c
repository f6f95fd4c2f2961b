#include "solver/method/tall_factors.h"

#include "solver/linalg/core.h"
#include "solver/linalg/dense.h"
#include "solver/method/method.h"

#include <lapacke.h>

#include <math.h>
#include <stdlib.h>

/* Rows that are multiplied at a time: work for every thread, and little beside U. */
enum { FOLD_ROWS = 8192 };

void tall_factors_free(tall_factors *f) {
    free(f->Q);
    free(f->V);
    *f = (tall_factors){0};
}

lam_status orthonormal_columns(size_t n, size_t k, float *Q, lam_error *error) {
    lam_status status = LAM_OK;
    /* LAPACK is column-major and sees Q^T: the QR of Q is the LQ of Q^T. */
    const lapack_int rows = (lapack_int)k, columns = (lapack_int)n;
    float *tau = memory_allocate(k, sizeof *tau, "QR", error);
    if (tau == NULL) TRY(LAM_ERR_MEMORY);
    lapack_int info = LAPACKE_sgelqf(LAPACK_COL_MAJOR, rows, columns, Q, rows, tau);
    if (info == 0) info = LAPACKE_sorglq(LAPACK_COL_MAJOR, rows, columns, rows, Q, rows, tau);
    if (info == LAPACK_WORK_MEMORY_ERROR) FAIL(error, LAM_ERR_MEMORY, "QR of %zu columns: out of memory", k);
    if (info != 0) FAIL(error, LAM_ERR_NUMERIC, "QR of %zu columns: LAPACK returned %d", k, (int)info);
done:
    free(tau);
    return status;
}

lam_status factors_fold(size_t n, size_t k, const float *core, const float *reflectance,
                        const uint32_t *order, float *U, lam_error *error) {
    const size_t most = n < FOLD_ROWS ? n : FOLD_ROWS;
    float *block = memory_allocate(most, k * sizeof *block, "operator", error);
    if (block == NULL) return LAM_ERR_MEMORY;
    for (size_t first = 0; first < n && k > 0; first += most) {
        const size_t rows = n - first < most ? n - first : most;
        dense_multiply(rows, k, k, U + first * k, core, false, block);
        for (size_t r = 0; r < rows; r++) {
            const float rho = reflectance[order != NULL ? order[first + r] : first + r];
            const float factor = rho > 0 ? -rho : -1;
            for (size_t c = 0; c < k; c++) U[(first + r) * k + c] = factor * block[r * k + c];
        }
    }
    free(block);
    return LAM_OK;
}

/* F ~ U V^T from S ~ Q V^T: U = A^-1/2 Q and V = A^1/2 V, as rows [n][k] in mesh order. */
static lam_status scale_back(const scaled_matrix *S, const tall_factors *f, float **U, float **V,
                             lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = f->n, k = f->rank;
    float *u = memory_allocate(n, k * sizeof *u, "operator", error), *v = NULL;
    v = memory_allocate(n, k * sizeof *v, "operator", error);
    if (u == NULL || v == NULL) TRY(LAM_ERR_MEMORY);
#pragma omp parallel for schedule(static, 64)
    for (size_t p = 0; p < n; p++) {
        const size_t i = S->order[p];
        const double root = S->root_area[i];
        for (size_t c = 0; c < k; c++) {
            u[i * k + c] = (float)((double)f->Q[p * k + c] / root);
            v[i * k + c] = (float)((double)f->V[p * k + c] * root);
        }
    }
    *U = u;
    *V = v;
    u = v = NULL;
done:
    free(u);
    free(v);
    return status;
}

lam_status operator_of_factors(const build_problem *problem, const scaled_matrix *S, tall_factors *f,
                               bool keep_factors, lam_operator **op, double *rcond, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n, C = problem->n_channels, k = f->rank;
    float *U = NULL, *V = NULL, *core = NULL;
    TRY(scale_back(S, f, &U, &V, error));
    tall_factors_free(f);
    core = memory_allocate(C, k * k * sizeof *core, "core", error);
    if (core == NULL) TRY(LAM_ERR_MEMORY);
    *rcond = 1;
    for (size_t c = 0; c < C; c++) {
        double one;
        TRY(core_factored(k, n, V, U, problem->reflectance + c * n, core + c * k * k, &one, error));
        *rcond = fmin(*rcond, one);
    }
    if (C == 1 && !keep_factors) {
        TRY(factors_fold(n, k, core, problem->reflectance, NULL, U, error));
        status = operator_low_rank_create_folded(n, k, problem->reflectance, U, V, op, error);
    } else {
        status = operator_low_rank_create_factored(n, k, C, problem->reflectance, U, V, core, op, error);
        core = NULL;
    }
    U = V = NULL;
done:
    free(U);
    free(V);
    free(core);
    return status;
}
