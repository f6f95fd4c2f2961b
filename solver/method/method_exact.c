/* exact: the whole inverse, in double. For scenes small enough that nothing else pays. */
#include "solver/base/clock.h"
#include "solver/method/choice.h"

#include <lapacke.h>

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* Up to SMALL elements the whole inverse is small, without error, and built in well under a second; above
 * MOST it takes too long. */
enum { SMALL = 1024, MOST = 12288 };

/* M = (I - R F)^-1 in place and the reciprocal condition number; M is [n][n] row-major. LAPACK reads it as
 * its transpose, whose inverse is the transpose of the inverse: nothing need be moved. */
static lam_status invert(size_t n, const csr *F, const float *rho, double *M, lapack_int *pivots,
                         double *rcond, lam_error *error) {
    lam_status status = LAM_OK;
    for (size_t i = 0; i < n; i++) {
        double *row = M + i * n;
        for (size_t j = 0; j < n; j++) row[j] = 0;
        row[i] = 1;
        for (uint64_t p = F->indptr[i]; p < F->indptr[i + 1]; p++)
            row[F->indices[p]] -= (double)rho[i] * (double)F->data[p];
    }
    const lapack_int size = (lapack_int)n;
    const double norm = LAPACKE_dlange(LAPACK_COL_MAJOR, '1', size, size, M, size);
    lapack_int info = LAPACKE_dgetrf(LAPACK_COL_MAJOR, size, size, M, size, pivots);
    if (info == 0) info = LAPACKE_dgecon(LAPACK_COL_MAJOR, '1', size, M, size, norm, rcond);
    if (info != 0 || *rcond < 1e-12)
        FAIL(error, LAM_ERR_NUMERIC,
             "I - R F of %zu elements cannot be inverted (LU returned %d, reciprocal condition %.1e); lower "
             "the "
             "largest reflectance",
             n, (int)info, info == 0 ? *rcond : 0.);
    info = LAPACKE_dgetri(LAPACK_COL_MAJOR, size, M, size, pivots);
    if (info != 0)
        FAIL(error, LAM_ERR_NUMERIC, "inverse of %zu elements: LAPACK dgetri returned %d", n, (int)info);
done:
    return status;
}

/* P = M - I; where rho_i = 0 the row is F_i M instead (contract, /operator). */
static void bounced(size_t n, const csr *F, const float *rho, const double *M, float *P) {
#pragma omp parallel for schedule(dynamic, 16)
    for (size_t i = 0; i < n; i++) {
        float *row = P + i * n;
        if (rho[i] > 0) {
            for (size_t j = 0; j < n; j++) row[j] = (float)(M[i * n + j] - (i == j ? 1 : 0));
            continue;
        }
        for (size_t j = 0; j < n; j++) {
            double sum = 0;
            for (uint64_t p = F->indptr[i]; p < F->indptr[i + 1]; p++)
                sum += (double)F->data[p] * M[(size_t)F->indices[p] * n + j];
            row[j] = (float)sum;
        }
    }
}

static lam_status build(const build_problem *problem, const build_options *options, const void *own,
                        lam_operator **op, build_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n, n_channels = problem->n_channels;
    const double start = clock_seconds();
    double *M = NULL;
    float *P = NULL;
    double worst = 1;
    lapack_int *pivots = NULL;
    (void)own;
    size_t square, bytes;
    if (n > INT_MAX || !size_multiply(n, n, &square) || !size_multiply(square, 8 + 4 * n_channels, &bytes) ||
        (options->memory > 0 && bytes > options->memory))
        FAIL(error, LAM_ERR_MEMORY,
             "--method exact: %zu elements in %zu channels need %.1f GiB, --memory allows %.1f; use --method "
             "low-rank",
             n, n_channels, (double)n * (double)n * (double)(8 + 4 * n_channels) * 0x1p-30,
             (double)options->memory * 0x1p-30);
    M = memory_allocate(square, sizeof *M, "exact inverse", error);
    P = memory_allocate(square, n_channels * sizeof *P, "exact operator", error);
    pivots = memory_allocate(n, sizeof *pivots, "exact inverse", error);
    if (M == NULL || P == NULL || pivots == NULL) TRY(LAM_ERR_MEMORY);

    for (size_t c = 0; c < n_channels; c++) {
        const float *rho = problem->reflectance + c * n;
        double rcond = 0;
        progress_report(options->progress, "invert", (double)c / (double)n_channels);
        if (progress_cancelled(options->progress)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
        TRY(invert(n, problem->F, rho, M, pivots, &rcond, error));
        bounced(n, problem->F, rho, M, P + c * square);
        worst = fmin(worst, rcond);
    }
    free(M);
    M = NULL;
    TRY(operator_exact_create(n, n_channels, problem->reflectance, P, op, error));
    P = NULL;
    report_number(report, "epsilon", 0);
    report_number(report, "rcond", worst);
    report_step_add(report, "invert", clock_seconds() - start);
done:
    free(M);
    free(P);
    free(pivots);
    return status;
}

static void forecast(const method_scale *scale, const void *own, method_forecast *out) {
    const double square = scale->n * scale->n, C = scale->n_channels;
    (void)own;
    *out = (method_forecast){
        .building = square * (8 + 4 * C), .loaded = 4 * square * C, .stored = 4 * square * C};
}

static lam_status weigh(const decision *so_far, void *own, candidate *out, lam_error *error) {
    const double n = (double)so_far->problem->n, C = (double)so_far->problem->n_channels;
    (void)own;
    (void)error;
    if (n > MOST || C * n * n > so_far->most) return LAM_OK;
    out->cost = n * n;
    out->certain = true;
    if (n > SMALL) return LAM_OK;
    out->claim = CLAIM_SMALL;
    snprintf(out->found, sizeof out->found,
             "%.0f elements are few enough (up to %d) to keep the whole inverse", n, SMALL);
    return LAM_OK;
}

const build_method method_exact = {
    .name = "exact",
    .summary = "the whole inverse; up to some thousand elements",
    .kind = &operator_exact,
    .smaller = "--method low-rank",
    .forecast = forecast,
    .weigh = weigh,
    .build = build,
};
