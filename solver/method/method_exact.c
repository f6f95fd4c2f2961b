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

/* The two sides of a pair of form factors may differ by this share of the larger one, in A^1/2 F A^-1/2,
 * where they are taken as one number. */
static const double reciprocal_within = 1e-5;

static lam_status fail_singular(size_t n, lapack_int info, double rcond, lam_error *error) {
    return status_fail(
        error, LAM_ERR_NUMERIC,
        "I - R F of %zu elements cannot be inverted (its factorization returned %d, reciprocal "
        "condition %.1e); lower the largest reflectance",
        n, (int)info, info == 0 ? rcond : 0.);
}

/* M = (I - R F)^-1 in place and the reciprocal condition number; M is [n][n] row-major. LAPACK reads it as
 * its transpose, whose inverse is the transpose of the inverse: nothing need be moved. */
static lam_status invert(size_t n, const csr *F, const float *rho, double *M, double *rcond,
                         lam_error *error) {
    lam_status status = LAM_OK;
    lapack_int *pivots = memory_allocate(n, sizeof *pivots, "exact inverse", error);
    if (pivots == NULL) return LAM_ERR_MEMORY;
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
    if (info != 0 || *rcond < 1e-12) TRY(fail_singular(n, info, *rcond, error));
    info = LAPACKE_dgetri(LAPACK_COL_MAJOR, size, M, size, pivots);
    if (info != 0)
        FAIL(error, LAM_ERR_NUMERIC, "inverse of %zu elements: LAPACK dgetri returned %d", n, (int)info);
done:
    free(pivots);
    return status;
}

/* M = (I - R F)^-1 is read, and P is written: P = M - I, so that B - E = P E; where rho_i = 0 the row is
 * F_i M instead, the irradiance of E (contract, /operator). */
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

/* Blocks of rows by columns that are read across and written down. */
enum { TILE = 64 };

static size_t tile_end(size_t first, size_t n) {
    return first + TILE < n ? first + TILE : n;
}

/* S = I - T K T, T_i = (rho_i / A_i)^1/2 and K_ij = A_i F_ij. False where F lacks reciprocity, so that K is
 * not symmetric. */
static bool make_symmetric(size_t n, const csr *F, const double *T, const double *area, double *S) {
    bool reciprocal = true;
#pragma omp parallel for schedule(static)
    for (size_t i = 0; i < n; i++) {
        double *row = S + i * n;
        for (size_t j = 0; j < n; j++) row[j] = 0;
        for (uint64_t p = F->indptr[i]; p < F->indptr[i + 1]; p++)
            row[F->indices[p]] += area[i] * (double)F->data[p];
    }
#pragma omp parallel for schedule(dynamic, 1) reduction(&& : reciprocal)
    for (size_t top = 0; top < n; top += TILE)
        for (size_t left = 0; left <= top; left += TILE)
            for (size_t i = top; i < tile_end(top, n); i++)
                for (size_t j = left; j < tile_end(left, n) && j <= i; j++) {
                    const double x = S[i * n + j], y = S[j * n + i];
                    reciprocal = reciprocal && fabs(x - y) <= reciprocal_within * fmax(x, y);
                    S[i * n + j] = S[j * n + i] = (i == j ? 1 : 0) - T[i] * T[j] * .5 * (x + y);
                }
    return reciprocal;
}

/* The upper triangle by rows from the lower one. */
static void mirror(size_t n, double *S) {
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t top = 0; top < n; top += TILE)
        for (size_t left = 0; left <= top; left += TILE)
            for (size_t i = top; i < tile_end(top, n); i++)
                for (size_t j = left; j < tile_end(left, n) && j < i; j++) S[j * n + i] = S[i * n + j];
}

/* S^-1 in place, whole, and the reciprocal condition number: half the work of an LU. LAPACK's upper triangle
 * by columns is the lower one by rows. */
static lam_status invert_symmetric(size_t n, double *S, double *rcond, lam_error *error) {
    const lapack_int size = (lapack_int)n;
    const double norm = LAPACKE_dlansy(LAPACK_COL_MAJOR, '1', 'U', size, S, size);
    lapack_int info = LAPACKE_dpotrf(LAPACK_COL_MAJOR, 'U', size, S, size);
    if (info == 0) info = LAPACKE_dpocon(LAPACK_COL_MAJOR, 'U', size, S, size, norm, rcond);
    if (info != 0 || *rcond < 1e-12) return fail_singular(n, info, *rcond, error);
    info = LAPACKE_dpotri(LAPACK_COL_MAJOR, 'U', size, S, size);
    if (info != 0)
        return status_fail(error, LAM_ERR_NUMERIC, "inverse of %zu elements: LAPACK dpotri returned %d", n,
                           (int)info);
    mirror(n, S);
    return LAM_OK;
}

/* out_j = sum of F_ik M_kj over the k that reflect. */
static void gather_row(size_t n, const csr *F, const float *rho, size_t i, const double *M, double *out) {
    for (size_t j = 0; j < n; j++) out[j] = 0;
    for (uint64_t p = F->indptr[i]; p < F->indptr[i + 1]; p++) {
        const size_t k = F->indices[p];
        if (!(rho[k] > 0)) continue;
        const double f = (double)F->data[p];
        for (size_t j = 0; j < n; j++) out[j] += f * M[k * n + j];
    }
}

/* From S^-1 to B - E = M E: M = T (S^-1 - I) T^-1 between elements that reflect, and elsewhere by H = F + F
 * M, the irradiance of E, with A_i H_ij = A_j H_ji. Rows of elements that do not reflect are H (contract,
 * /operator). */
static void scale_symmetric(size_t n, const csr *F, const float *rho, const double *T, const double *area,
                            double *M) {
#pragma omp parallel for schedule(dynamic, 16)
    for (size_t i = 0; i < n; i++) {
        double *row = M + i * n;
        row[i] -= 1;
        for (size_t j = 0; j < n; j++) row[j] = T[j] > 0 ? T[i] * row[j] / T[j] : 0;
    }
    /* H_aj of a that does not reflect, by the light of the j that do; then, by reciprocity, M_ja = rho_j
     * H_ja; then H_ab of two that do not. */
#pragma omp parallel for schedule(dynamic, 16)
    for (size_t a = 0; a < n; a++) {
        if (rho[a] > 0) continue;
        double *row = M + a * n;
        gather_row(n, F, rho, a, M, row);
        for (uint64_t p = F->indptr[a]; p < F->indptr[a + 1]; p++) row[F->indices[p]] += (double)F->data[p];
    }
#pragma omp parallel for schedule(dynamic, 16)
    for (size_t j = 0; j < n; j++)
        for (size_t a = 0; a < n && rho[j] > 0; a++)
            if (!(rho[a] > 0)) M[j * n + a] = (double)rho[j] * area[a] / area[j] * M[a * n + j];
#pragma omp parallel for schedule(dynamic, 16)
    for (size_t a = 0; a < n; a++)
        for (uint64_t p = F->indptr[a]; p < F->indptr[a + 1] && !(rho[a] > 0); p++) {
            const size_t k = F->indices[p];
            for (size_t b = 0; b < n && rho[k] > 0; b++)
                if (!(rho[b] > 0)) M[a * n + b] += (double)F->data[p] * M[k * n + b];
        }
}

/* P of one channel, B - E = P E, by way of the matrix M [n][n]. Let T_i = (rho_i / A_i)^1/2, S = I - T K T
 * and K_ij = A_i F_ij. Then
 *     I - R F = T S T^-1,   P = (I - R F)^-1 - I = T (S^-1 - I) T^-1.
 * First M is S, after invert_symmetric() it is S^-1, and after scale_symmetric() it is P in double. Where
 * K is not symmetric, M is I - R F, invert() makes it (I - R F)^-1, and bounced() makes P of that. */
static lam_status make_channel(const build_problem *problem, const float *rho, double *M, float *P,
                               double *rcond, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n;
    const csr *F = problem->F;
    double *T = memory_allocate(n, sizeof *T, "exact inverse", error);
    if (T == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < n; i++) T[i] = sqrt((double)rho[i] / problem->area[i]);
    if (!make_symmetric(n, F, T, problem->area, M)) {
        TRY(invert(n, F, rho, M, rcond, error));
        bounced(n, F, rho, M, P);
        goto done;
    }
    TRY(invert_symmetric(n, M, rcond, error));
    scale_symmetric(n, F, rho, T, problem->area, M);
#pragma omp parallel for schedule(static)
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) P[i * n + j] = (float)M[i * n + j];
done:
    free(T);
    return status;
}

static lam_status build(const build_problem *problem, const build_options *options, const void *own,
                        lam_operator **op, build_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n, n_channels = problem->n_channels;
    const double start = clock_seconds();
    double *M = NULL;
    float *P = NULL;
    double worst = 1;
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
    if (M == NULL || P == NULL) TRY(LAM_ERR_MEMORY);

    for (size_t c = 0; c < n_channels; c++) {
        const float *rho = problem->reflectance + c * n;
        double rcond = 0;
        progress_report(options->progress, "invert", (double)c / (double)n_channels);
        if (progress_cancelled(options->progress)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
        TRY(make_channel(problem, rho, M, P + c * square, &rcond, error));
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
