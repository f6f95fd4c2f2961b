/* sparse: for scenes that hide most of themselves, where F has few entries and no low rank (Aguerre 2016,
 * chapter 4). */
#include "solver/base/clock.h"
#include "solver/method/reference.h"
#include "solver/method/sparse/sparse_inverse.h"
#include "solver/operator/sparse.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* How close to 1 the solution with light everywhere comes that delta is measured by. */
static const double delta_tolerance = 1e-7;
/* By what a threshold rises at a time where memory is too small, and what its forecast may be wrong by. */
static const double rise = 1.25, doubt = 1.15;

/* Of an entry: its column and its value, in rows and, transposed, in columns. */
enum { ENTRY_BYTES = 2 * (sizeof(uint32_t) + sizeof(float)) };

static const char *const corrections[] = {
    [SPARSE_NONE] = "none", [SPARSE_DELTA] = "delta", [SPARSE_DISCARDED] = "discarded"};

const char *sparse_correction_name(sparse_correction correction) {
    return corrections[correction];
}

bool sparse_correction_find(const char *name, sparse_correction *correction) {
    for (sparse_correction c = SPARSE_NONE; c <= SPARSE_DISCARDED; c++) {
        if (strcmp(corrections[c], name) != 0) continue;
        *correction = c;
        return true;
    }
    return false;
}

/* The smallest threshold from that asked for on whose entries memory is forecast to hold, of all channels. */
static lam_status fitting_threshold(const build_problem *problem, const build_options *options,
                                    double *threshold, lam_error *error) {
    lam_status status = LAM_OK;
    *threshold = options->threshold;
    for (double needed = INFINITY; options->memory > 0 && needed > (double)options->memory;) {
        needed = 0;
        for (size_t c = 0; c < problem->n_channels; c++) {
            double entries;
            TRY(sparse_inverse_forecast(problem, problem->reflectance + c * problem->n, *threshold, &entries,
                                        error));
            needed += doubt * entries * ENTRY_BYTES;
        }
        if (needed > (double)options->memory) *threshold *= rise;
        if (*threshold >= 1)
            FAIL(error, LAM_ERR_MEMORY, "--method sparse: no --threshold below 1 fits into --memory");
    }
done:
    return status;
}

/* delta_p = sum_j (P - P~)_pj, from one solution with E = 1: exact for light that is everywhere the same. */
static lam_status find_delta(const build_problem *problem, const float *rho, const csr *M, float *delta,
                             const progress *told, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n;
    reference *r = NULL;
    double *E = memory_allocate(n, sizeof *E, "sparse inverse", error);
    double *B = memory_allocate(n, sizeof *B, "sparse inverse", error);
    double *H = E; /* E is no longer needed then */
    if (E == NULL || B == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) E[i] = B[i] = 1;
    TRY(reference_create(problem->F, problem->area, rho, REFERENCE_ITERATED, &r, error));
    TRY(reference_solve(r, 1, E, B, delta_tolerance, told, error));
    csr_multiply_rows(problem->F, 0, n, 1, B, H);
    for (size_t p = 0; p < n; p++) {
        const size_t i = problem->order[p];
        const double bounced = rho[i] > 0 ? (double)rho[i] * H[i] : H[i];
        double kept = 0;
        for (uint64_t e = M->indptr[p]; e < M->indptr[p + 1]; e++) kept += (double)M->data[e];
        delta[p] = (float)(bounced - kept);
    }
done:
    reference_destroy(r);
    free(E);
    free(B);
    return status;
}

/* What the mean of E is weighted by: areas, or, as in the thesis, elements alike. */
static void set_weights(const build_problem *problem, sparse_correction correction, float *weight) {
    double sum = 0;
    for (size_t i = 0; i < problem->n; i++) sum += problem->area[i];
    for (size_t p = 0; p < problem->n; p++)
        weight[p] = correction == SPARSE_DELTA ? (float)(problem->area[problem->order[p]] / sum)
                                               : 1 / (float)problem->n;
}

static lam_status build(const build_problem *problem, const build_options *options, lam_operator **op,
                        build_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n, C = problem->n_channels;
    const double started = clock_seconds();
    sparse_inverse inverse = {.bounces = 0};
    sparse_arrays arrays = {.M = memory_allocate(C, sizeof *arrays.M, "operator", error)};
    lam_operator *made = NULL;
    double entries = 0, threshold;
    size_t bounces = 0, left = options->memory;
    if (arrays.M == NULL) TRY(LAM_ERR_MEMORY);
    if (options->correction != SPARSE_NONE) {
        arrays.delta = memory_allocate(n, C * sizeof *arrays.delta, "operator", error);
        arrays.weight = memory_allocate(n, sizeof *arrays.weight, "operator", error);
        if (arrays.delta == NULL || arrays.weight == NULL) TRY(LAM_ERR_MEMORY);
        set_weights(problem, options->correction, arrays.weight);
    }
    TRY(fitting_threshold(problem, options, &threshold, error));
    for (size_t c = 0; c < C; c++) {
        const float *rho = problem->reflectance + c * n;
        TRY(sparse_inverse_rows(problem, rho, threshold, left / 2, options->progress, &inverse, error));
        arrays.M[c] = inverse.M;
        inverse.M = (csr){.n = 0};
        const size_t stored = (size_t)arrays.M[c].indptr[n];
        entries += (double)stored;
        if (left > 0) left -= stored * ENTRY_BYTES;
        if (inverse.bounces > bounces) bounces = inverse.bounces;
        if (options->correction == SPARSE_DISCARDED)
            for (size_t p = 0; p < n; p++) arrays.delta[c * n + p] = (float)inverse.discarded[p];
        if (options->correction == SPARSE_DELTA)
            TRY(find_delta(problem, rho, &arrays.M[c], arrays.delta + c * n, options->progress, error));
        sparse_inverse_free(&inverse);
    }
    TRY(operator_sparse_create(n, C, problem->reflectance, &arrays, &made, error));
    TRY(operator_set_order(made, problem->order, error));
    report->method = "sparse";
    report->threshold = threshold;
    report->correction = options->correction;
    report->epsilon = -1;
    report->invert_seconds = clock_seconds() - started;
    snprintf(report->reason, sizeof report->reason,
             "sparse: asked for by --method; %.3g %% of all entries, %zu bounces%s",
             100 * entries / ((double)n * (double)n * (double)C), bounces,
             threshold > options->threshold ? ", the threshold raised to fit into --memory" : "");
    *op = made;
    made = NULL;
done:
    sparse_inverse_free(&inverse);
    sparse_arrays_free(&arrays, C);
    lam_operator_close(made);
    return status;
}

const build_method build_sparse = {"sparse", build};
