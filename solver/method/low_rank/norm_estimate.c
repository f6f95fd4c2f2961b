#include "solver/linalg/dense.h"
#include "solver/method/low_rank/sketch.h"
#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { VECTORS = 8, ITERATIONS = 3 };

/* y -= U (V^T x) of w vectors. */
static lam_status take_away(size_t n, size_t m, size_t w, const float *U, const float *V, const float *x,
                            float *y, lam_error *error) {
    lam_status status = LAM_OK;
    float *t = NULL, *product = NULL;
    double *T = memory_allocate(m, w * sizeof *T, "norm", error);
    t = memory_allocate(m, w * sizeof *t, "norm", error);
    product = memory_allocate(n, w * sizeof *product, "norm", error);
    if (T == NULL || t == NULL || product == NULL) TRY(LAM_ERR_MEMORY);
    TRY(dense_project(n, m, w, V, x, T, error));
    for (size_t k = 0; k < m * w; k++) t[k] = (float)T[k];
    dense_multiply(n, m, w, U, t, false, product);
    for (size_t k = 0; k < n * w; k++) y[k] -= product[k];
done:
    free(T);
    free(t);
    free(product);
    return status;
}

/* The largest singular value of Y, [n][w], w small. */
static lam_status largest_value(size_t n, size_t w, const float *Y, double *value, lam_error *error) {
    const truncation one = {.rank = 1};
    tall_factors f = {0};
    const lam_status status = tsvd(n, w, Y, &one, &f, error);
    double sum = 0;
    if (status != LAM_OK) return status;
    for (size_t i = 0; i < n; i++) sum += (double)f.Q[i] * (double)f.Q[i];
    tall_factors_free(&f);
    *value = sqrt(sum);
    return LAM_OK;
}

lam_status norm_estimate(const scaled_matrix *S, size_t m, const float *X, const float *B, uint64_t seed,
                         double *norm, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = S->n;
    size_t w = n < VECTORS ? n : VECTORS;
    float *x = NULL, *y = memory_allocate(n, w * sizeof *y, "norm", error);
    x = memory_allocate(n, w * sizeof *x, "norm", error);
    if (x == NULL || y == NULL) TRY(LAM_ERR_MEMORY);
    *norm = 0;
    sketch_gaussian(~seed, n, w, x);
    for (int k = 0; k < ITERATIONS; k++) {
        TRY(sketch_orthonormalize(n, w, x, &w, error));
        if (w == 0) break;
        TRY(scaled_multiply(S, w, x, y, error)); /* y = (S - B X^T) x */
        TRY(take_away(n, m, w, B, X, x, y, error));
        TRY(largest_value(n, w, y, norm, error));
        TRY(scaled_multiply(S, w, y, x, error)); /* x = (S - X B^T) y */
        TRY(take_away(n, m, w, X, B, y, x, error));
    }
done:
    free(x);
    free(y);
    return status;
}
