#include "solver/method/norm.h"

#include "solver/base/random.h"

#include <cblas.h>
#include <lapacke.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STEPS = 32 };

/* The difference D = S - Q V^T and the space its products need. */
typedef struct difference {
    const scaled_matrix *S;
    const tall_factors *f;
    double *y;       /* [n] */
    float *x_single; /* [n] */
    float *t;        /* [rank] */
} difference;

/* y = D x, or y = D^T x; the product with Q V^T is made in single precision, its rounding is far below any
 * bound a factorization in single precision can have. */
static lam_status difference_multiply(const difference *D, bool transposed, const double *x, double *y,
                                      lam_error *error) {
    const size_t n = D->f->n, k = D->f->rank;
    const float *first = transposed ? D->f->Q : D->f->V, *second = transposed ? D->f->V : D->f->Q;
    const lam_status status = scaled_multiply_double(D->S, x, y, error); /* S is symmetric */
    if (status != LAM_OK || k == 0) return status;
    for (size_t i = 0; i < n; i++) D->x_single[i] = (float)x[i];
    cblas_sgemv(CblasRowMajor, CblasTrans, (int)n, (int)k, 1, first, (int)k, D->x_single, 1, 0, D->t, 1);
    cblas_sgemv(CblasRowMajor, CblasNoTrans, (int)n, (int)k, 1, second, (int)k, D->t, 1, 0, D->x_single, 1);
    for (size_t i = 0; i < n; i++) y[i] -= (double)D->x_single[i];
    return LAM_OK;
}

/* Largest eigenvalue of the symmetric tridiagonal matrix of Lanczos. */
static lam_status largest_ritz(int steps, const double *diagonal, const double *off, double *largest,
                               lam_error *error) {
    double d[STEPS], e[STEPS];
    memcpy(d, diagonal, (size_t)steps * sizeof *d);
    memcpy(e, off, (size_t)steps * sizeof *e);
    const lapack_int info = LAPACKE_dsterf(steps, d, e);
    if (info != 0) return status_fail(error, LAM_ERR_NUMERIC, "norm: LAPACK dsterf returned %d", (int)info);
    *largest = d[steps - 1];
    return LAM_OK;
}

lam_status norm_of_product(size_t n, norm_product *product, void *context, const progress *p, double *norm,
                           lam_error *error) {
    lam_status status = LAM_OK;
    const int steps = n < STEPS ? (int)n : STEPS;
    double *basis = memory_allocate((size_t)steps * n, sizeof *basis, "norm", error);
    double *w = memory_allocate(n, sizeof *w, "norm", error);
    if (basis == NULL || w == NULL) TRY(LAM_ERR_MEMORY);

    /* A start that no symmetry of a scene is likely to be orthogonal to. */
    uint64_t state = 1;
    for (size_t i = 0; i < n; i++) {
        basis[i] = random_lcg_unit(&state) - .5;
    }
    cblas_dscal((int)n, 1 / cblas_dnrm2((int)n, basis, 1), basis, 1);

    double diagonal[STEPS] = {0}, off[STEPS] = {0}, largest = 0;
    int done_steps = 0;
    for (int s = 0; s < steps; s++) {
        if (progress_cancelled(p)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
        progress_report(p, "check norm", (double)s / steps);
        const double *q = basis + (size_t)s * n;
        TRY(product(context, q, w, error));
        diagonal[s] = cblas_ddot((int)n, q, 1, w, 1);
        done_steps = s + 1;
        for (int twice = 0; twice < 2; twice++)
            for (int b = 0; b <= s; b++) {
                const double *v = basis + (size_t)b * n;
                cblas_daxpy((int)n, -cblas_ddot((int)n, v, 1, w, 1), v, 1, w, 1);
            }
        off[s] = cblas_dnrm2((int)n, w, 1);
        if (s + 1 == steps || off[s] <= 1e-14) break;
        cblas_dcopy((int)n, w, 1, basis + (size_t)(s + 1) * n, 1);
        cblas_dscal((int)n, 1 / off[s], basis + (size_t)(s + 1) * n, 1);
    }
    TRY(largest_ritz(done_steps, diagonal, off, &largest, error));
    *norm = sqrt(fmax(largest, 0));
done:
    free(basis);
    free(w);
    return status;
}

static lam_status difference_square(void *context, const double *q, double *w, lam_error *error) {
    const difference *D = context;
    const lam_status status = difference_multiply(D, false, q, D->y, error);
    return status != LAM_OK ? status : difference_multiply(D, true, D->y, w, error);
}

void norm_report(const build_problem *problem, double norm, build_report *report) {
    double brightest = 0;
    for (size_t i = 0; i < problem->n_channels * problem->n; i++)
        brightest = fmax(brightest, (double)problem->reflectance[i]);
    report_number(report, "measured_norm_error", norm);
    report_text(report, "norm", "2");
    report_number(report, "relative_bound", norm / (1 - brightest));
}

lam_status norm_of_error(const scaled_matrix *S, const tall_factors *f, const progress *p, double *norm,
                         lam_error *error) {
    lam_status status = LAM_OK;
    difference D = {.S = S, .f = f};
    D.y = memory_allocate(f->n, sizeof *D.y, "norm", error);
    D.x_single = memory_allocate(f->n, sizeof *D.x_single, "norm", error);
    D.t = memory_allocate(f->rank, sizeof *D.t, "norm", error);
    if (D.y == NULL || D.x_single == NULL || D.t == NULL) TRY(LAM_ERR_MEMORY);
    TRY(norm_of_product(f->n, difference_square, &D, p, norm, error));
done:
    free(D.y);
    free(D.x_single);
    free(D.t);
    return status;
}
