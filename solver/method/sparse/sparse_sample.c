/* Estimates the size and the error of a sparse inverse from a sample of its rows. */
#include "solver/method/sparse/sparse_inverse.h"
#include "solver/method/sparse/sparse_rows.h"

#include <math.h>
#include <stdlib.h>

enum { SAMPLED = 256 };

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

/* A row of M - M~ and the column of its element: figures that are summed in order, so that the bits do not
 * depend on threads. */
typedef struct row_lack {
    double entries, square, sum;
    double column; /* |column of M - M~| / |column of M - I|, area-weighted */
    double missing[SAMPLED_GROUPS], light[SAMPLED_GROUPS];
} row_lack;

/* The column, without entries below the threshold: (M - I)_ji for all j, from row i. */
static double column_lack(const build_problem *p, const float *rho, double threshold,
                          const inverse_rows *truth, size_t k) {
    double square = 0, whole = 0;
    for (size_t position = 0; position < truth->n; position++) {
        const size_t j = p->order[position];
        const double x =
            inverse_rows_factor(truth, p, rho, k, position) * (double)truth->rows[k * truth->n + position];
        whole += p->area[j] * x * x;
        if (x < threshold) square += p->area[j] * x * x;
    }
    return whole > 0 ? sqrt(square / whole) : 0;
}

/* The light of groups that row k lacks once the sum of all that it lacks, for uniform emission, is given back
 * by the share that a group has of all area. absent [n] by position: the row of M - M~. */
static void groups_lack(const build_problem *p, const sampled_groups *g, const double *share,
                        const float *row, const float *absent, row_lack *out) {
    sampled_groups_sum(g, p, row, out->light);
    sampled_groups_sum(g, p, absent, out->missing);
    for (size_t v = 0; v < g->count; v++) out->missing[v] -= out->sum * share[v];
}

/* Shares of the largest groups in all area. */
static void find_shares(const build_problem *p, const sampled_groups *g, double share[SAMPLED_GROUPS]) {
    double all = 0;
    for (size_t v = 0; v < g->count; v++) share[v] = 0;
    for (size_t i = 0; i < p->n; i++) {
        all += p->area[i];
        for (size_t v = 0; v < g->count; v++)
            if (p->group[i] == g->group[v]) share[v] += p->area[i];
    }
    for (size_t v = 0; v < g->count; v++) share[v] /= all;
}

lam_status sparse_inverse_sample(const build_problem *problem, const float *rho, const sparse_limits *limits,
                                 const inverse_rows *truth, sparse_sample *out, lam_error *error) {
    lam_status status = LAM_OK;
    rows_job job = {.position = NULL};
    sampled_groups groups;
    const size_t n = problem->n;
    bool failed = false;
    double share[SAMPLED_GROUPS], entries = 0, square = 0, sum = 0, columns = 0;
    row_lack *lacks = memory_allocate(truth->count, sizeof *lacks, "rows of a sparse inverse", error);
    if (lacks == NULL) return LAM_ERR_MEMORY;
    TRY(sampled_groups_find(problem, &groups, error));
    find_shares(problem, &groups, share);
    TRY(rows_job_begin(problem, rho, limits, &job, error));
#pragma omp parallel
    {
        row_work d;
        lam_error own = {.message = ""};
        float *absent = memory_allocate(n, sizeof *absent, "rows of a sparse inverse", &own);
        const bool ready = row_work_make(n, &d, &own) == LAM_OK && absent != NULL;
#pragma omp for schedule(dynamic, 1)
        for (size_t k = 0; k < truth->count; k++) {
            const float *row = truth->rows + k * n;
            double discarded;
            size_t bounces;
            uint64_t length = 0;
            row_lack *lack = lacks + k;
            d.used = 0;
            if (ready) row_work_compute(&job, k * n / truth->count, &d, &discarded, &bounces);
            if (!ready || !row_work_store(&d, &length)) {
#pragma omp atomic write
                failed = true;
                continue;
            }
            lack->entries = (double)length;
            for (size_t j = 0, e = 0; j < n; j++) {
                const double there = e < length && d.indices[e] == j ? (double)d.data[e++] : 0;
                const double x = (double)row[j] - there;
                absent[j] = (float)x;
                lack->square += x * x;
                lack->sum += x;
            }
            lack->column = column_lack(problem, rho, limits->threshold, truth, k);
            groups_lack(problem, &groups, share, row, absent, lack);
        }
        row_work_free(&d);
        free(absent);
    }
    if (failed) FAIL(error, LAM_ERR_MEMORY, "sparse inverse: out of memory");
    for (size_t k = 0; k < truth->count; k++) {
        entries += lacks[k].entries;
        square += lacks[k].square;
        sum += lacks[k].sum;
        columns += lacks[k].column;
        sampled_groups_add(&groups, problem->area[problem->order[k * n / truth->count]], lacks[k].missing,
                           lacks[k].light);
    }
    *out = sample_of(truth, entries, square, sum);
    out->errors =
        (sampled_errors){.single = columns / (double)truth->count, .groups = sampled_groups_mean(&groups)};
done:
    rows_job_end(&job);
    free(lacks);
    return status;
}
