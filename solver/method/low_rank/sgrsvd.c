/* The sub-Gaussian randomized SVD (Aizenbud and Averbuch 2016; Aguerre 2016, algorithm 3): sketches by sparse
 * Gaussian matrices, and S X found from a sketch of S by least squares instead of by another pass. As both
 * sketches can be taken at once, one pass suffices in place of the two of algorithm 3. */
#include "solver/linalg/dense.h"
#include "solver/method/low_rank/sketch.h"
#include "store/status.h"

#include <cblas.h>
#include <lapacke.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Rows of the sketches over l_2. */
enum { WIDER = 2 };

/* X = Omega_1^* Omega_1'^*, [n][l2]: row i is a sum of a few rows of Omega_1'^*, [k1][l2]. */
static lam_status first_sketch(uint64_t seed, size_t n, size_t k1, size_t l2, size_t stride, float *X,
                               lam_error *error) {
    float *gaussian = memory_allocate(k1, l2 * sizeof *gaussian, "factorization", error);
    if (gaussian == NULL) return LAM_ERR_MEMORY;
    sketch_gaussian(seed, k1, l2, gaussian);
#pragma omp parallel for schedule(static)
    for (size_t i = 0; i < n; i++) {
        float *x = X + i * stride;
        memset(x, 0, l2 * sizeof *x);
        sketch_entry column[SKETCH_ENTRIES];
        sketch_sparse_column(~seed, k1, i, column);
        for (size_t e = 0; e < SKETCH_ENTRIES; e++) {
            const float *row = gaussian + column[e].row * l2;
            for (size_t c = 0; c < l2; c++) x[c] += column[e].value * row[c];
        }
    }
    free(gaussian);
    return LAM_OK;
}

/* Omega_2^*, [n][k2]. */
static void second_sketch(uint64_t seed, size_t n, size_t k2, size_t stride, float *X) {
#pragma omp parallel for schedule(static)
    for (size_t i = 0; i < n; i++) {
        float *x = X + i * stride;
        memset(x, 0, k2 * sizeof *x);
        sketch_entry column[SKETCH_ENTRIES];
        sketch_sparse_column(seed ^ 0x5bd1e995u, k2, i, column);
        for (size_t e = 0; e < SKETCH_ENTRIES; e++) x[column[e].row] += column[e].value;
    }
}

/* W [k2][m] with C^dagger D = (D^* W)^*: W = C (C^* C)^-1, C [k2][m]. */
static lam_status pseudo_inverse(size_t k2, size_t m, const double *C, float *W, lam_error *error) {
    lam_status status = LAM_OK;
    double *Q = memory_allocate(k2, m * sizeof *Q, "factorization", error), *R = NULL, *tau = NULL;
    R = memory_allocate(m, m * sizeof *R, "factorization", error);
    tau = memory_allocate(m, sizeof *tau, "factorization", error);
    if (Q == NULL || R == NULL || tau == NULL) TRY(LAM_ERR_MEMORY);
    memcpy(Q, C, k2 * m * sizeof *Q);
    lapack_int info = LAPACKE_dgeqrf(LAPACK_ROW_MAJOR, (lapack_int)k2, (lapack_int)m, Q, (lapack_int)m, tau);
    for (size_t i = 0; info == 0 && i < m; i++)
        for (size_t j = i; j < m; j++) R[i * m + j] = Q[i * m + j];
    if (info == 0)
        info = LAPACKE_dorgqr(LAPACK_ROW_MAJOR, (lapack_int)k2, (lapack_int)m, (lapack_int)m, Q,
                              (lapack_int)m, tau);
    if (info != 0) FAIL(error, LAM_ERR_NUMERIC, "sgrsvd: LAPACK returned %d", (int)info);
    for (size_t i = 0; i < m; i++)
        if (!(fabs(R[i * m + i]) > 1e-9 * fabs(R[0])))
            FAIL(error, LAM_ERR_NUMERIC, "sgrsvd: a sketch of %zu rows does not see all of %zu directions",
                 k2, m);
    /* C = Q R, W = Q R^-* */
    cblas_dtrsm(CblasRowMajor, CblasRight, CblasUpper, CblasTrans, CblasNonUnit, (int)k2, (int)m, 1, R,
                (int)m, Q, (int)m);
    for (size_t k = 0; k < k2 * m; k++) W[k] = (float)Q[k];
done:
    free(Q);
    free(R);
    free(tau);
    return status;
}

static lam_status find_basis(const scaled_matrix *S, const factorizer_options *options, size_t m,
                             sketch_basis *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = S->n, l2 = m, k1 = WIDER * l2, k2 = WIDER * l2, all = l2 + k2;
    sketch_basis b = {.n = n};
    float *omega = NULL, *product = NULL, *W = NULL, *sketch = NULL, *D = NULL;
    double *C = NULL;
    omega = memory_allocate(n, all * sizeof *omega, "factorization", error);
    product = memory_allocate(n, all * sizeof *product, "factorization", error);
    if (omega == NULL || product == NULL) TRY(LAM_ERR_MEMORY);
    TRY(first_sketch(options->seed, n, k1, l2, all, omega, error));
    second_sketch(options->seed, n, k2, all, omega + l2);
    progress_report(options->progress, "factorize", 0);
    TRY(scaled_multiply(S, all, omega, product, error)); /* B = A Omega_1^* Omega_1'^*, D^* = A Omega_2^* */
    if (progress_cancelled(options->progress)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
    b.X = memory_allocate(n, l2 * sizeof *b.X, "factorization", error);
    D = memory_allocate(n, k2 * sizeof *D, "factorization", error);
    sketch = memory_allocate(n, k2 * sizeof *sketch, "factorization", error);
    if (b.X == NULL || D == NULL || sketch == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) {
        memcpy(b.X + i * l2, product + i * all, l2 * sizeof *b.X);
        memcpy(D + i * k2, product + i * all + l2, k2 * sizeof *D);
        memcpy(sketch + i * k2, omega + i * all + l2, k2 * sizeof *sketch);
    }
    free(omega);
    free(product);
    omega = product = NULL;
    TRY(sketch_orthonormalize(n, l2, b.X, &m, error)); /* B = Q R */
    C = memory_allocate(k2, m * sizeof *C, "factorization", error);
    W = memory_allocate(k2, m * sizeof *W, "factorization", error);
    b.B = memory_allocate(n, m * sizeof *b.B, "factorization", error);
    if (C == NULL || W == NULL || b.B == NULL) TRY(LAM_ERR_MEMORY);
    if (m > 0) {
        TRY(dense_project(n, k2, m, sketch, b.X, C, error)); /* C = Omega_2 Q */
        TRY(pseudo_inverse(k2, m, C, W, error));
        dense_multiply(n, k2, m, D, W, false, b.B); /* (C^dagger D)^* ~ A^* Q */
    }
    b.m = m;
    *out = b;
    b = (sketch_basis){0};
done:
    free(omega);
    free(product);
    free(sketch);
    free(D);
    free(W);
    free(C);
    sketch_basis_free(&b);
    return status;
}

static lam_status sgrsvd_factorize(const scaled_matrix *S, const factorizer_options *options,
                                   tall_factors *out, factorizer_report *report, lam_error *error) {
    (void)report;
    return sketch_factorize(S, options, find_basis, false, out, error);
}

const factorizer factorizer_sgrsvd = {"sgrsvd", sgrsvd_factorize};
