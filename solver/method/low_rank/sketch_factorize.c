/* Factors Q V^T from a sketched basis, at a given rank or error bound. */
#include "solver/linalg/dense.h"
#include "solver/method/low_rank/sketch.h"
#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A basis has OVERSAMPLING vectors beyond the rank (and twice the rank if B is only close to S X). Given a
 * bound alone, it begins with max(BASIS_LEAST, n / BASIS_SHARE) vectors. */
enum { OVERSAMPLING = 16, BASIS_LEAST = 64, BASIS_SHARE = 12 };

void sketch_basis_free(sketch_basis *b) {
    free(b->X);
    free(b->B);
    *b = (sketch_basis){0};
}

/* The truncated SVD of B; V = X V_B. */
static lam_status truncate(const sketch_basis *b, const truncation *keep, tall_factors *out,
                           lam_error *error) {
    lam_status status = LAM_OK;
    tall_factors f = {0};
    float *V = NULL;
    TRY(tsvd(b->n, b->m, b->B, keep, &f, error));
    V = memory_allocate(b->n, f.rank * sizeof *V, "factorization", error);
    if (V == NULL) TRY(LAM_ERR_MEMORY);
    dense_multiply(b->n, b->m, f.rank, b->X, f.V, false, V);
    free(f.V);
    f.V = V;
    f.m = b->n;
    V = NULL;
    *out = f;
    f = (tall_factors){0};
done:
    free(V);
    tall_factors_free(&f);
    return status;
}

/* Appends columns of zeros up to `rank`. */
static lam_status pad(tall_factors *f, size_t rank, lam_error *error) {
    lam_status status = LAM_OK;
    float **const both[] = {&f->Q, &f->V};
    for (int k = 0; k < 2 && f->rank < rank; k++) {
        float *wide = memory_allocate(f->n, rank * sizeof *wide, "factorization", error);
        if (wide == NULL) TRY(LAM_ERR_MEMORY);
        for (size_t i = 0; i < f->n && f->rank > 0; i++)
            memcpy(wide + i * rank, *both[k] + i * f->rank, f->rank * sizeof *wide);
        free(*both[k]);
        *both[k] = wide;
    }
    if (f->rank < rank) f->rank = rank;
done:
    return status;
}

/* The length of column c of Q: its singular value. */
static double column_norm(const tall_factors *f, size_t c) {
    double sum = 0;
    for (size_t i = 0; i < f->n; i++) {
        const double q = (double)f->Q[i * f->rank + c];
        sum += q * q;
    }
    return sqrt(sum);
}

/* Scales columns of Q longer than 1 to length 1: no singular value of S is above 1. */
static void cut_to_one(tall_factors *f) {
    for (size_t c = 0; c < f->rank; c++) {
        const double size = column_norm(f, c);
        if (size <= 1) break; /* the lengths descend */
        for (size_t i = 0; i < f->n; i++)
            f->Q[i * f->rank + c] = (float)((double)f->Q[i * f->rank + c] / size);
    }
}

/* *m: the size of a basis at which the singular values reach a bound, extrapolated from the last half of
 * these. */
static lam_status larger_basis(const sketch_basis *b, double bound, size_t *m, lam_error *error) {
    lam_status status = LAM_OK;
    tall_factors f = {0};
    const truncation all = {.rank = b->m};
    TRY(tsvd(b->n, b->m, b->B, &all, &f, error));
    const size_t last = f.rank - 1, middle = f.rank / 2;
    const double size[2] = {fmax(column_norm(&f, middle), 1e-30), fmax(column_norm(&f, last), 1e-30)};
    /* log s falls as a straight line; a basis never grows more than twofold at once. */
    const double slope = last > middle ? log(size[0] / size[1]) / (double)(last - middle) : 0;
    const double more = slope > 0 ? log(fmax(size[1] / bound, 1)) / slope : INFINITY;
    const double wanted = 1.1 * ((double)b->m + fmin(more, (double)b->m)) + OVERSAMPLING;
    *m = wanted < (double)b->n ? (size_t)wanted : b->n;
done:
    tall_factors_free(&f);
    return status;
}

static lam_status fixed_precision(const scaled_matrix *S, const factorizer_options *o, sketch_find find,
                                  bool exact, tall_factors *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = S->n;
    const double alpha = o->budget.alpha, spare = 1.1;
    const double kept = o->epsilon * (exact ? sqrt(alpha) : alpha);
    const double left = o->epsilon * (exact ? sqrt(1 - alpha) : 1 - alpha) / spare;
    const truncation keep = {.epsilon = kept};
    sketch_basis b = {0};
    size_t m = n / BASIS_SHARE > BASIS_LEAST ? n / BASIS_SHARE : BASIS_LEAST;
    for (m = m < n ? m : n;;) {
        double norm = 0;
        sketch_basis_free(&b);
        TRY(find(S, o, m, &b, error));
        if (b.m > 0) TRY(norm_estimate(S, b.m, b.X, b.B, o->seed, &norm, error));
        if (norm <= left) break;
        if (m >= n)
            FAIL(error, LAM_ERR_NUMERIC,
                 "epsilon %g: below what a sketch in single precision can reach; use hf", o->epsilon);
        TRY(larger_basis(&b, left / 2, &m, error));
    }
    TRY(truncate(&b, &keep, out, error));
done:
    sketch_basis_free(&b);
    return status;
}

static lam_status fixed_rank(const scaled_matrix *S, const factorizer_options *o, sketch_find find,
                             bool exact, tall_factors *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = S->n, rank = o->rank < n ? o->rank : n;
    const size_t m = exact ? rank + OVERSAMPLING : 2 * rank + OVERSAMPLING;
    const truncation keep = {.rank = rank};
    sketch_basis b = {0};
    tall_factors f = {0};
    TRY(find(S, o, m < n ? m : n, &b, error));
    TRY(truncate(&b, &keep, &f, error));
    TRY(pad(&f, rank, error));
    *out = f;
    f = (tall_factors){0};
done:
    sketch_basis_free(&b);
    tall_factors_free(&f);
    return status;
}

lam_status sketch_factorize(const scaled_matrix *S, const factorizer_options *options, sketch_find find,
                            bool exact, tall_factors *out, lam_error *error) {
    lam_status status = LAM_OK;
    if (options->rank > 0)
        TRY(fixed_rank(S, options, find, exact, out, error));
    else
        TRY(fixed_precision(S, options, find, exact, out, error));
    if (!exact) cut_to_one(out);
done:
    return status;
}
