#include "solver/method/low_rank/sketch.h"

#include "solver/base/random.h"
#include "solver/linalg/dense.h"
#include "store/status.h"

#include <lapacke.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Two numbers uniform over [0, 1), the first never 0. */
static void uniform_pair(uint64_t key, double *one, double *two) {
    const uint64_t bits = random_hash(key), more = random_hash(bits);
    *one = ((double)(bits >> 11) + .5) * 0x1p-53;
    *two = random_to_double(more);
}

void sketch_gaussian(uint64_t seed, size_t n, size_t m, float *X) {
    const uint64_t key = random_hash(seed);
    const size_t pairs = (n * m + 1) / 2;
#pragma omp parallel for schedule(static)
    for (size_t k = 0; k < pairs; k++) { /* Box and Muller 1958 */
        double u, turn;
        uniform_pair(key + k, &u, &turn);
        const double radius = sqrt(-2 * log(u)), angle = 2 * M_PI * turn;
        X[2 * k] = (float)(radius * cos(angle));
        if (2 * k + 1 < n * m) X[2 * k + 1] = (float)(radius * sin(angle));
    }
}

void sketch_sparse_column(uint64_t seed, size_t k, size_t i, sketch_entry column[SKETCH_ENTRIES]) {
    const uint64_t key = random_hash(seed);
    for (size_t e = 0; e < SKETCH_ENTRIES; e++) {
        double u, turn, place, unused;
        uniform_pair(key + 2 * (i * SKETCH_ENTRIES + e), &u, &turn);
        uniform_pair(key + 2 * (i * SKETCH_ENTRIES + e) + 1, &place, &unused);
        const size_t row = (size_t)(place * (double)k);
        column[e] = (sketch_entry){.row = row < k ? row : k - 1,
                                   .value = (float)(sqrt(-2 * log(u)) * cos(2 * M_PI * turn))};
    }
}

/* W with (Y W)^T (Y W) = I: R^-1 of Cholesky's G = R^T R; false where G is not definite enough. */
static bool whiten_by_cholesky(size_t m, const double *G, double *W) {
    const lapack_int k = (lapack_int)m;
    double largest = 0, least = INFINITY;
    memcpy(W, G, m * m * sizeof *W);
    /* Row-major upper is LAPACK's lower: G = L L^T, and L^-1 there is R^-T here. */
    if (LAPACKE_dpotrf(LAPACK_COL_MAJOR, 'L', k, W, k) != 0) return false;
    for (size_t i = 0; i < m; i++) {
        largest = fmax(largest, W[i * m + i]);
        least = fmin(least, W[i * m + i]);
    }
    if (!(least > 1e-6 * largest)) return false;
    if (LAPACKE_dtrtri(LAPACK_COL_MAJOR, 'L', 'N', k, W, k) != 0) return false;
    for (size_t i = 0; i < m; i++)
        for (size_t j = 0; j < i; j++) W[i * m + j] = 0;
    return true;
}

/* The same by eigenvectors, [m][*rank], without the directions that hardly are there. */
static lam_status whiten_by_eigenvectors(size_t m, double *G, double *W, size_t *rank, lam_error *error) {
    double *values = memory_allocate(m, sizeof *values, "a basis", error);
    if (values == NULL) return LAM_ERR_MEMORY;
    const lapack_int info =
        LAPACKE_dsyevd(LAPACK_COL_MAJOR, 'V', 'L', (lapack_int)m, G, (lapack_int)m, values);
    size_t kept = 0;
    if (info == 0) {
        while (kept < m && values[m - 1 - kept] > 1e-12 * values[m - 1] && values[m - 1 - kept] > 0) kept++;
        for (size_t i = 0; i < m; i++)
            for (size_t c = 0; c < kept; c++)
                W[i * kept + c] = G[(m - 1 - c) * m + i] / sqrt(values[m - 1 - c]);
    }
    free(values);
    *rank = kept;
    return info == 0 ? LAM_OK
                     : status_fail(error, LAM_ERR_NUMERIC,
                                   "a basis of %zu vectors: LAPACK dsyevd returned %d", m, (int)info);
}

/* One pass of it. */
static lam_status orthonormalize_once(size_t n, size_t *m, float *Y, lam_error *error) {
    lam_status status = LAM_OK;
    float *w = NULL, *product = NULL;
    size_t rank = *m;
    double *W = NULL, *G = memory_allocate(*m, *m * sizeof *G, "a basis", error);
    W = memory_allocate(*m, *m * sizeof *W, "a basis", error);
    if (G == NULL || W == NULL) TRY(LAM_ERR_MEMORY);
    TRY(dense_gram_double(n, *m, Y, G, error));
    if (!whiten_by_cholesky(*m, G, W)) TRY(whiten_by_eigenvectors(*m, G, W, &rank, error));
    w = memory_allocate(*m, rank * sizeof *w, "a basis", error);
    product = memory_allocate(n, rank * sizeof *product, "a basis", error);
    if (w == NULL || product == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < *m * rank; k++) w[k] = (float)W[k];
    dense_multiply(n, *m, rank, Y, w, false, product);
    memcpy(Y, product, n * rank * sizeof *Y);
    *m = rank;
done:
    free(G);
    free(W);
    free(w);
    free(product);
    return status;
}

lam_status sketch_orthonormalize(size_t n, size_t m, float *Y, size_t *rank, lam_error *error) {
    lam_status status = LAM_OK;
    for (int twice = 0; twice < 2 && m > 0; twice++) TRY(orthonormalize_once(n, &m, Y, error));
    *rank = m;
done:
    return status;
}
