/* Randomized subspace iteration (Halko et al. 2011; Aguerre 2016, algorithm 2, without iterations algorithm
 * 1): S ~ (S X) X^T with an orthonormal basis X of S^(q+1) Omega, Omega a random matrix. S is symmetric,
 * so that one product serves as A and as A*. */
#include "solver/method/low_rank/sketch.h"
#include "store/status.h"

#include <stdlib.h>

/* The first iteration reduces the error by a third, a second one by 6 %. */
enum { ITERATIONS = 1 };

/* 2 + iterations passes. */
static lam_status find_basis(const scaled_matrix *S, const factorizer_options *options, size_t m,
                             sketch_basis *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = S->n;
    const int passes = 2 + (options->iterations >= 0 ? options->iterations : ITERATIONS);
    sketch_basis b = {.n = n};
    b.X = memory_allocate(n, m * sizeof *b.X, "factorization", error);
    b.B = memory_allocate(n, m * sizeof *b.B, "factorization", error);
    if (b.X == NULL || b.B == NULL) TRY(LAM_ERR_MEMORY);
    sketch_gaussian(options->seed, n, m, b.X);
    for (int pass = 0; pass < passes && m > 0; pass++) { /* m = 0: S = 0 */
        if (progress_cancelled(options->progress)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
        progress_report(options->progress, "factorize", (double)pass / passes);
        TRY(scaled_multiply(S, m, b.X, b.B, error)); /* Y = S X */
        if (pass + 1 == passes) break;
        float *Y = b.B;
        b.B = b.X;
        b.X = Y;
        TRY(sketch_orthonormalize(n, m, b.X, &m, error)); /* Y = Q R, X = Q */
    }
    b.m = m;
    *out = b;
    b = (sketch_basis){0};
done:
    sketch_basis_free(&b);
    return status;
}

static lam_status rsi_factorize(const scaled_matrix *S, const factorizer_options *options, tall_factors *out,
                                factorizer_report *report, lam_error *error) {
    (void)report;
    return sketch_factorize(S, options, find_basis, true, out, error);
}

const factorizer factorizer_rsi = {"rsi", rsi_factorize};
