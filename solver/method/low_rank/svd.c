/* All eigenvectors of S: S = X L X^T, so that Q = X L and V = X, ordered by |l|, are its singular value
 * decomposition. The best approximation of any rank (Eckart and Young 1936), in n^2 memory and n^3 time. */
#include "solver/method/low_rank/eigen.h"
#include "solver/method/low_rank/factorizer.h"

#include <lapacke.h>

#include <math.h>
#include <stdlib.h>

/* An eigenvalue and the index of its vector in the output of LAPACK. */
typedef struct eigenvalue {
    float value;
    uint32_t index;
} eigenvalue;

static int by_falling_size(const void *a, const void *b) {
    const float x = fabsf(((const eigenvalue *)a)->value), y = fabsf(((const eigenvalue *)b)->value);
    return (x < y) - (x > y);
}

static lam_status eigenvectors(size_t n, float *S, float *w, lam_error *error) {
    lam_status status = LAM_OK;
    if (n > EIGEN_SINGLE_MOST)
        FAIL(error, LAM_ERR_ARGUMENT, "--factorizer svd: %zu elements, at most %d; use hf or rsi", n,
             EIGEN_SINGLE_MOST);
    const int info = eigen_single(n, true, S, w);
    if (info == LAPACK_WORK_MEMORY_ERROR)
        FAIL(error, LAM_ERR_MEMORY, "--factorizer svd: %zu elements: out of memory; use hf or rsi", n);
    if (info != 0) FAIL(error, LAM_ERR_NUMERIC, "eigenvectors of S: LAPACK ssyevd returned %d", info);
done:
    return status;
}

static lam_status svd_factorize(const scaled_matrix *S, const factorizer_options *options, tall_factors *out,
                                factorizer_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = S->n;
    tall_factors f = {.n = n, .m = n};
    const truncation keep = {.epsilon = options->epsilon, .rank = options->rank};
    eigenvalue *sorted = NULL;
    double *squares = NULL;
    float *w = NULL, *vectors = memory_allocate(n, n * sizeof *vectors, "factorization", error);
    (void)report;
    w = memory_allocate(n, sizeof *w, "factorization", error);
    sorted = memory_allocate(n, sizeof *sorted, "factorization", error);
    squares = memory_allocate(n, sizeof *squares, "factorization", error);
    if (vectors == NULL || w == NULL || sorted == NULL || squares == NULL) TRY(LAM_ERR_MEMORY);
    TRY(scaled_dense(S, vectors, error));
    progress_report(options->progress, "factorize", .1);
    TRY(eigenvectors(n, vectors, w, error));
    if (progress_cancelled(options->progress)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
    for (size_t i = 0; i < n; i++) sorted[i] = (eigenvalue){w[i], (uint32_t)i};
    if (n > 0) qsort(sorted, n, sizeof *sorted, by_falling_size);
    for (size_t i = 0; i < n; i++) squares[n - 1 - i] = (double)sorted[i].value * (double)sorted[i].value;
    const size_t k = f.rank = truncation_rank(&keep, n, squares);
    f.Q = memory_allocate(n, k * sizeof *f.Q, "factorization", error);
    f.V = memory_allocate(n, k * sizeof *f.V, "factorization", error);
    if (f.Q == NULL || f.V == NULL) TRY(LAM_ERR_MEMORY);
#pragma omp parallel for schedule(static, 64)
    for (size_t i = 0; i < n; i++)
        for (size_t c = 0; c < k; c++) {
            f.V[i * k + c] = vectors[(size_t)sorted[c].index * n + i];
            f.Q[i * k + c] = f.V[i * k + c] * sorted[c].value;
        }
    *out = f;
    f = (tall_factors){0};
done:
    free(vectors);
    free(w);
    free(sorted);
    free(squares);
    tall_factors_free(&f);
    return status;
}

const factorizer factorizer_svd = {"svd", svd_factorize};
