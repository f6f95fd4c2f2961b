/* The k x k core of a low-rank operator: the Sherman-Morrison-Woodbury inverse (Aguerre 2016, eq. 2.8). */
#include "solver/operator/core.h"

#include <cblas.h>
#include <lapacke.h>
#include <math.h>
#include <stdlib.h>

/* Rows of U and V that are in double at a time. */
#define CORE_PANEL 512
/* k * k must stay below what a 32-bit lapack_int counts to. */
#define CORE_MAX_K 46340

lam_status core_invert(size_t k, double *K, double *rcond, lam_error *error) {
    lam_status status = LAM_OK;
    lapack_int *pivots = NULL;
    double reciprocal = 1.0;
    if (k > CORE_MAX_K)
        FAIL(error, LAM_ERR_ARGUMENT,
             "a core of %zu columns, at most %d can be inverted; use a larger epsilon", k, CORE_MAX_K);
    if (k > 0) {
        lapack_int order = (lapack_int)k;
        pivots = memory_allocate(k, sizeof *pivots, "pivots of the core", error);
        if (pivots == NULL) {
            status = LAM_ERR_MEMORY;
            goto done;
        }
        /* LAPACK sees K^T, whose inverse is the transpose of ours; its infinity-norm is our 1-norm. */
        double norm = LAPACKE_dlange(LAPACK_COL_MAJOR, 'I', order, order, K, order);
        lapack_int info = LAPACKE_dgetrf(LAPACK_COL_MAJOR, order, order, K, order, pivots);
        if (info == LAPACK_WORK_MEMORY_ERROR)
            FAIL(error, LAM_ERR_MEMORY, "core: not enough memory to factorize");
        if (info < 0 || !isfinite(norm)) FAIL(error, LAM_ERR_NUMERIC, "core of %zu columns is not finite", k);
        if (info > 0) {
            reciprocal = 0.0;
        } else {
            info = LAPACKE_dgecon(LAPACK_COL_MAJOR, 'I', order, K, order, norm, &reciprocal);
            if (info == LAPACK_WORK_MEMORY_ERROR)
                FAIL(error, LAM_ERR_MEMORY, "core: not enough memory to judge");
            if (info != 0) FAIL(error, LAM_ERR_INTERNAL, "core: LAPACK's dgecon says %d", (int)info);
        }
        if (!(reciprocal >= CORE_RCOND_MIN))
            FAIL(error, LAM_ERR_NUMERIC,
                 "core of %zu columns is nearly singular: rcond = %.3g, must be at least %g; "
                 "use a smaller epsilon or a smaller largest reflectance",
                 k, reciprocal, CORE_RCOND_MIN);
        info = LAPACKE_dgetri(LAPACK_COL_MAJOR, order, K, order, pivots);
        if (info == LAPACK_WORK_MEMORY_ERROR)
            FAIL(error, LAM_ERR_MEMORY, "core: not enough memory to invert");
        if (info != 0) FAIL(error, LAM_ERR_INTERNAL, "core: LAPACK's dgetri says %d", (int)info);
    }
    *rcond = reciprocal;
done:
    free(pivots);
    return status;
}

lam_status core_factored(size_t k, size_t n, const float *V, const float *U, const float *rho, float *core,
                         double *rcond, lam_error *error) {
    lam_status status = LAM_OK;
    double *K = NULL, *V_rows = NULL, *RU_rows = NULL;
    size_t square, panel_size, rows_max = n < CORE_PANEL ? n : CORE_PANEL;
    if (k > CORE_MAX_K || !size_multiply(k, k, &square) || !size_multiply(rows_max, k, &panel_size))
        FAIL(error, LAM_ERR_ARGUMENT,
             "a core of %zu columns, at most %d can be inverted; use a larger epsilon", k, CORE_MAX_K);
    K = memory_allocate(square, sizeof *K, "core", error);
    V_rows = memory_allocate(panel_size, sizeof *V_rows, "core", error);
    RU_rows = memory_allocate(panel_size, sizeof *RU_rows, "core", error);
    if (K == NULL || V_rows == NULL || RU_rows == NULL) {
        status = LAM_ERR_MEMORY;
        goto done;
    }
    for (size_t j = 0; j < k; j++) K[j * k + j] = 1.0;
    for (size_t first = 0; first < n && k > 0; first += rows_max) {
        size_t rows = n - first < rows_max ? n - first : rows_max;
        for (size_t r = 0; r < rows; r++)
            for (size_t j = 0; j < k; j++) {
                V_rows[r * k + j] = (double)V[(first + r) * k + j];
                RU_rows[r * k + j] = (double)rho[first + r] * (double)U[(first + r) * k + j];
            }
        /* K -= V^T (R U) */
        cblas_dgemm(CblasRowMajor, CblasTrans, CblasNoTrans, (int)k, (int)k, (int)rows, -1.0, V_rows, (int)k,
                    RU_rows, (int)k, 1.0, K, (int)k);
    }
    TRY(core_invert(k, K, rcond, error));
    for (size_t j = 0; j < square; j++) core[j] = (float)K[j];
done:
    free(K);
    free(V_rows);
    free(RU_rows);
    return status;
}
