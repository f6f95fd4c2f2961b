/* The k x k core of a low-rank operator: the Sherman-Morrison-Woodbury inverse (Aguerre 2016, eq. 2.8). */
#include "solver/linalg/core.h"

#include <cblas.h>
#include <lapacke.h>
#include <math.h>
#include <omp.h>
#include <stdlib.h>

/* Rows of U and V that are in double at a time. */
#define CORE_PANEL 512
/* k * k must stay below what a 32-bit lapack_int counts to. */
#define CORE_MAX_K 46340

static bool is_cancelled(atomic_bool *cancelled) {
    return cancelled != NULL && atomic_load(cancelled);
}

/* LAPACK is not interrupted; the flag is tested between its calls. */
static lam_status invert(size_t k, double *K, double *rcond, atomic_bool *cancelled, lam_error *error) {
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
        if (is_cancelled(cancelled)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
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

lam_status core_invert(size_t k, double *K, double *rcond, lam_error *error) {
    return invert(k, K, rcond, NULL, error);
}

/* Rows first ... first + count of U or V in double; floats has room for as many when they are in a panel. */
static void take_rows(const float *array, const panel *a, size_t k, size_t first, size_t count, float *floats,
                      double *rows) {
    const float *from = floats;
    if (array != NULL)
        from = array + first * k;
    else
        panel_copy_some(a, first, count, floats);
    for (size_t j = 0; j < count * k; j++) rows[j] = (double)from[j];
}

/* Room for CORE_PANEL rows. */
typedef struct core_rows {
    double *U, *V; /* V: NULL where it has one entry a row */
    float *floats;
} core_rows;

/* K -= V^T R U, rows first ... first + count. */
static void take_off(const core_factors *in, size_t first, size_t count, const core_rows *rows, size_t *p,
                     double *K) {
    const size_t k = in->k;
    take_rows(in->U, in->U_panel, k, first, count, rows->floats, rows->U);
    for (size_t r = 0; r < count; r++) { /* R U; with one entry of V a row, times that entry */
        const size_t j = first + r;
        double factor = (double)in->rho[in->order != NULL ? in->order[j] : j];
        if (in->begin != NULL && in->weight != NULL) factor *= (double)in->weight[j];
        for (size_t q = 0; q < k; q++) rows->U[r * k + q] *= factor;
    }
    if (in->begin == NULL) {
        take_rows(in->V, in->V_panel, k, first, count, rows->floats, rows->V);
        cblas_dgemm(CblasRowMajor, CblasTrans, CblasNoTrans, (int)k, (int)k, (int)count, -1.0, rows->V,
                    (int)k, rows->U, (int)k, 1.0, K, (int)k);
        return;
    }
    for (size_t r = 0; r < count; r++) { /* row p of V^T is nonzero in run p alone */
        while (*p + 1 < k && in->begin[*p + 1] <= first + r) ++*p;
        for (size_t q = 0; q < k; q++) K[*p * k + q] -= rows->U[r * k + q];
    }
}

lam_status core_make(const core_factors *in, float *core, double *rcond, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t k = in->k, n = in->n, rows_max = n < CORE_PANEL ? n : CORE_PANEL;
    double *K = NULL;
    core_rows rows = {.U = NULL};
    size_t square, panel_size, p = 0;
    if (k > CORE_MAX_K || !size_multiply(k, k, &square) || !size_multiply(rows_max, k, &panel_size))
        FAIL(error, LAM_ERR_ARGUMENT,
             "a core of %zu columns, at most %d can be inverted; use a larger epsilon", k, CORE_MAX_K);
    K = memory_allocate(square, sizeof *K, "core", error);
    rows.U = memory_allocate(panel_size, sizeof *rows.U, "core", error);
    if (in->begin == NULL) rows.V = memory_allocate(panel_size, sizeof *rows.V, "core", error);
    if (in->U == NULL) rows.floats = memory_allocate(panel_size, sizeof *rows.floats, "core", error);
    if (K == NULL || rows.U == NULL || (in->begin == NULL && rows.V == NULL) ||
        (in->U == NULL && rows.floats == NULL)) {
        status = LAM_ERR_MEMORY;
        goto done;
    }
    for (size_t j = 0; j < k; j++) K[j * k + j] = 1.0;
    for (size_t first = 0; first < n && k > 0; first += rows_max) {
        if (is_cancelled(in->cancelled)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
        take_off(in, first, n - first < rows_max ? n - first : rows_max, &rows, &p, K);
    }
    TRY(invert(k, K, rcond, in->cancelled, error));
    for (size_t j = 0; j < square; j++) core[j] = (float)K[j];
done:
    free(K);
    free(rows.U);
    free(rows.V);
    free(rows.floats);
    return status;
}

lam_status core_factored(size_t k, size_t n, const float *V, const float *U, const float *rho, float *core,
                         double *rcond, lam_error *error) {
    return core_make(&(core_factors){.n = n, .k = k, .U = U, .V = V, .rho = rho}, core, rcond, error);
}

void core_keep_thread_limit(void) {
    const int limit = omp_get_thread_limit();
    if (openblas_get_num_threads() > limit) openblas_set_num_threads(limit);
    if (omp_get_max_threads() > limit) omp_set_num_threads(limit);
}

void core_use_one_thread(void) {
    openblas_set_num_threads(1);
    omp_set_num_threads(1);
}
