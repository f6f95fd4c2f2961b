/* Estimates the size and the error of a sparse inverse from a sample of its rows. */
#include "solver/method/many_lights.h"
#include "solver/method/sparse/sparse_inverse.h"
#include "solver/method/sparse/sparse_rows.h"

#include <math.h>
#include <stdlib.h>

enum { SAMPLED = 256, COMPARED = 32 };

lam_status sparse_inverse_forecast(const build_problem *problem, const float *rho,
                                   const sparse_limits *limits, double *entries, lam_error *error) {
    lam_status status = LAM_OK;
    rows_job job;
    row_work d = {.n = 0};
    const size_t n = problem->n, sampled = n < SAMPLED ? n : SAMPLED;
    TRY(rows_job_begin(problem, rho, limits, &job, error));
    TRY(row_work_make(n, &d, error));
    for (size_t k = 0; k < sampled; k++) {
        double discarded;
        size_t bounces;
        uint64_t count;
        row_work_compute(&job, k * n / sampled, &d, &discarded, &bounces);
        if (!row_work_store(&d, &count)) FAIL(error, LAM_ERR_MEMORY, "sparse inverse: out of memory");
    }
    *entries = (double)d.used * (double)n / (double)sampled;
done:
    rows_job_end(&job);
    row_work_free(&d);
    return status;
}

void inverse_rows_free(inverse_rows *r) {
    free(r->rows);
    *r = (inverse_rows){.rows = NULL};
}

/* Column i of M - I, T [n] = (M - I)_ji, to its row i: with H_ji = T_j / rho'_j, (M - I)_ij = rho'_i H_ji A_j
 * / A_i, where rho' is rho, or 1 in place of 0. */
static void column_to_row(const build_problem *p, const float *rho, size_t i, const float *T, float *row) {
    const double own = rho[i] > 0 ? (double)rho[i] : 1;
    for (size_t position = 0; position < p->n; position++) {
        const size_t j = p->order[position];
        const double H = (double)T[j] / (rho[j] > 0 ? (double)rho[j] : 1);
        row[position] = (float)(own * H * p->area[j] / p->area[i]);
    }
}

lam_status inverse_rows_find(const build_problem *problem, const float *rho, const progress *p,
                             inverse_rows *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n, count = n < COMPARED ? n : COMPARED;
    many_lights_report report;
    inverse_rows found = {.n = n, .count = count};
    float *E = memory_allocate(count, n * sizeof *E, "rows of an inverse", error);
    float *T = memory_allocate(count, n * sizeof *T, "rows of an inverse", error);
    found.rows = memory_allocate(count, n * sizeof *found.rows, "rows of an inverse", error);
    if (E == NULL || T == NULL || found.rows == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < count; k++) E[k * n + problem->order[k * n / count]] = 1;
    const many_lights_input unit = {.n = n,
                                    .F = problem->F,
                                    .area = problem->area,
                                    .rho = rho,
                                    .m = count,
                                    .E = E,
                                    .progress = p,
                                    .stage = "sample the inverse"};
    TRY(many_lights_solve(&unit, 1e-5, T, &report, error));
    for (size_t k = 0; k < count; k++)
        column_to_row(problem, rho, problem->order[k * n / count], T + k * n, found.rows + k * n);
    for (size_t k = 0; k < count * n; k++) {
        found.square += (double)found.rows[k] * (double)found.rows[k];
        found.sum += (double)found.rows[k];
    }
    *out = found;
    found.rows = NULL;
done:
    free(E);
    free(T);
    inverse_rows_free(&found);
    return status;
}

/* square, sum: of M - M~ over the sampled rows. */
static sparse_sample sample_of(const inverse_rows *r, double entries, double square, double sum) {
    return (sparse_sample){.entries = entries * (double)r->n / (double)r->count,
                           .single = r->square > 0 ? sqrt(square / r->square) : 0,
                           .everywhere = r->sum > 0 ? fmax(0, sum / r->sum) : 0};
}

sparse_sample inverse_rows_truncated(const inverse_rows *r, double threshold) {
    double entries = 0, square = 0, sum = 0;
    for (size_t k = 0; k < r->count * r->n; k++) {
        const double x = (double)r->rows[k];
        if (x >= threshold) {
            entries++;
        } else {
            square += x * x;
            sum += x;
        }
    }
    return sample_of(r, entries, square, sum);
}

lam_status sparse_inverse_sample(const build_problem *problem, const float *rho, const sparse_limits *limits,
                                 const inverse_rows *truth, sparse_sample *out, lam_error *error) {
    lam_status status = LAM_OK;
    rows_job job;
    const size_t n = problem->n;
    bool failed = false;
    double entries = 0, square = 0, sum = 0;
    double *missing = memory_allocate(truth->count, 3 * sizeof *missing, "rows of a sparse inverse", error);
    if (missing == NULL) return LAM_ERR_MEMORY;
    TRY(rows_job_begin(problem, rho, limits, &job, error));
#pragma omp parallel
    {
        row_work d;
        lam_error own = {.message = ""};
        const bool ready = row_work_make(n, &d, &own) == LAM_OK;
#pragma omp for schedule(dynamic, 1)
        for (size_t k = 0; k < truth->count; k++) {
            const float *row = truth->rows + k * n;
            double discarded, *lack = missing + 3 * k;
            size_t bounces;
            uint64_t length = 0;
            d.used = 0;
            if (ready) row_work_compute(&job, k * n / truth->count, &d, &discarded, &bounces);
            if (!ready || !row_work_store(&d, &length)) {
#pragma omp atomic write
                failed = true;
                continue;
            }
            lack[0] = (double)length;
            for (size_t j = 0, e = 0; j < n; j++) {
                const double there = e < length && d.indices[e] == j ? (double)d.data[e++] : 0;
                const double x = (double)row[j] - there;
                lack[1] += x * x;
                lack[2] += x;
            }
        }
        row_work_free(&d);
    }
    if (failed) FAIL(error, LAM_ERR_MEMORY, "sparse inverse: out of memory");
    for (size_t k = 0; k < truth->count; k++) { /* in order, so that the bits do not depend on threads */
        entries += missing[3 * k];
        square += missing[3 * k + 1];
        sum += missing[3 * k + 2];
    }
    *out = sample_of(truth, entries, square, sum);
done:
    rows_job_end(&job);
    free(missing);
    return status;
}
