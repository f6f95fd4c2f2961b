/* The leading eigenvectors of a Gram matrix by subspace iteration, for when they are few. */
#include "solver/linalg/dense.h"
#include "solver/method/low_rank/gram.h"
#include "solver/method/low_rank/sketch.h"
#include "solver/method/norm.h"
#include "store/status.h"

#include <cblas.h>
#include <lapacke.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The first guess is m / FIRST_GUESS eigenvectors; above m / GIVE_UP the full decomposition is cheaper. */
enum { FIRST_GUESS = 16, GIVE_UP = 3, ITERATIONS = 3 };

/* Ritz values approach eigenvalues from below: they are kept from this share of the floor on. */
static const double slack = .9;

/* Copies the upper half to the lower one. */
static void fill_symmetric(gram *g) {
    for (size_t i = 0; i < g->m; i++)
        for (size_t j = 0; j < i; j++) g->single[i * g->m + j] = g->single[j * g->m + i];
}

/* Rayleigh and Ritz: X [m][w] orthonormal becomes X Z, with Z the eigenvectors of X^T G X by falling value.
 */
static lam_status ritz(size_t m, size_t w, const float *G, float *X, double *values, lam_error *error) {
    lam_status status = LAM_OK;
    float *Z = NULL, *product = memory_allocate(m, w * sizeof *product, "factorization", error);
    double *T = memory_allocate(w, w * sizeof *T, "factorization", error);
    Z = memory_allocate(w, w * sizeof *Z, "factorization", error);
    if (product == NULL || T == NULL || Z == NULL) TRY(LAM_ERR_MEMORY);
    dense_multiply(m, m, w, G, X, false, product);
    TRY(dense_project(m, w, w, X, product, T, error));
    const lapack_int info =
        LAPACKE_dsyevd(LAPACK_COL_MAJOR, 'V', 'L', (lapack_int)w, T, (lapack_int)w, values);
    if (info != 0) FAIL(error, LAM_ERR_NUMERIC, "Ritz values: LAPACK dsyevd returned %d", (int)info);
    for (size_t i = 0; i < w; i++)
        for (size_t c = 0; c < w; c++) Z[i * w + c] = (float)T[(w - 1 - c) * w + i];
    for (size_t k = 0; k < w / 2; k++) {
        const double swap = values[k];
        values[k] = values[w - 1 - k];
        values[w - 1 - k] = swap;
    }
    dense_multiply(m, w, w, X, Z, false, product);
    memcpy(X, product, m * w * sizeof *X);
done:
    free(product);
    free(T);
    free(Z);
    return status;
}

/* G between projections that take the first r columns of V [m][w] away. */
typedef struct deflated {
    size_t m, w, r;
    const float *G, *V;
    float *x, *y; /* [m] */
    float *t;     /* [r] */
} deflated;

/* x -= V (V^T x) */
static void deflate(const deflated *d, float *x) {
    const int m = (int)d->m, w = (int)d->w, r = (int)d->r;
    if (r == 0) return;
    cblas_sgemv(CblasRowMajor, CblasTrans, m, r, 1, d->V, w, x, 1, 0, d->t, 1);
    cblas_sgemv(CblasRowMajor, CblasNoTrans, m, r, -1, d->V, w, d->t, 1, 1, x, 1);
}

/* w = (I - V V^T) G (I - V V^T) q */
static lam_status deflated_multiply(void *context, const double *q, double *w, lam_error *error) {
    (void)error;
    const deflated *d = context;
    const int m = (int)d->m;
    for (size_t i = 0; i < d->m; i++) d->x[i] = (float)q[i];
    deflate(d, d->x);
    cblas_sgemv(CblasRowMajor, CblasNoTrans, m, m, 1, d->G, m, d->x, 1, 0, d->y, 1);
    deflate(d, d->y);
    for (size_t i = 0; i < d->m; i++) w[i] = (double)d->y[i];
    return LAM_OK;
}

/* The largest x^T G x over |x| = 1 orthogonal to the first r columns of V. */
static lam_status largest_beside(size_t m, const float *G, size_t w, size_t r, const float *V,
                                 double *largest, lam_error *error) {
    lam_status status = LAM_OK;
    double norm;
    deflated d = {.m = m, .w = w, .r = r, .G = G, .V = V};
    d.x = memory_allocate(m, sizeof *d.x, "norm", error);
    d.y = memory_allocate(m, sizeof *d.y, "norm", error);
    d.t = memory_allocate(r, sizeof *d.t, "norm", error);
    if (d.x == NULL || d.y == NULL || d.t == NULL) TRY(LAM_ERR_MEMORY);
    TRY(norm_of_product(m, deflated_multiply, &d, NULL, &norm, error));
    *largest = norm * norm; /* G is A^T A: its largest value is |A|^2 */
done:
    free(d.x);
    free(d.y);
    free(d.t);
    return status;
}

/* One attempt with w vectors; *rank is 0 where they are not enough. */
static lam_status attempt(size_t m, const float *G, size_t w, double floor, float **V, size_t *rank,
                          lam_error *error) {
    lam_status status = LAM_OK;
    size_t found = w, kept = 0;
    double *values = NULL, beside;
    float *v = NULL, *product = NULL, *X = memory_allocate(m, w * sizeof *X, "factorization", error);
    values = memory_allocate(w, sizeof *values, "factorization", error);
    product = memory_allocate(m, w * sizeof *product, "factorization", error);
    if (X == NULL || values == NULL || product == NULL) TRY(LAM_ERR_MEMORY);
    sketch_gaussian(3, m, w, product);
    for (int k = 0; k < ITERATIONS; k++) {
        dense_multiply(m, m, found, G, product, false, X);
        TRY(sketch_orthonormalize(m, found, X, &found, error));
        memcpy(product, X, m * found * sizeof *X);
    }
    TRY(ritz(m, found, G, X, values, error));
    while (kept < found && values[kept] >= slack * floor) kept++;
    if (kept + kept / 8 >= found && found == w) goto done; /* there may be more of them */
    TRY(largest_beside(m, G, found, kept, X, &beside, error));
    if (beside > floor) goto done;
    v = memory_allocate(m, kept * sizeof *v, "factorization", error);
    if (v == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < m; i++)
        if (kept > 0) memcpy(v + i * kept, X + i * found, kept * sizeof *v);
    *V = v;
    *rank = kept;
done:
    free(X);
    free(values);
    free(product);
    return status;
}

lam_status gram_leading(gram *g, double floor, size_t guess, float **V, size_t *rank, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t m = g->m;
    *V = NULL;
    *rank = 0;
    fill_symmetric(g);
    /* A quarter more than expected, so that the iteration converges fast. */
    for (size_t w = guess > 0 ? guess + guess / 4 + 8 : m / FIRST_GUESS;
         w * GIVE_UP <= m && *V == NULL && w > 0; w *= 2)
        TRY(attempt(m, g->single, w, floor, V, rank, error));
done:
    return status;
}
