/* low-rank: factorize S, then Sherman-Morrison-Woodbury (thesis eq. 2.8) with the areas scaled back. */
#include "solver/build/build.h"
#include "solver/build/factorizer.h"
#include "solver/build/norm.h"
#include "solver/clock.h"
#include "solver/operator/core.h"

#include <cblas.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* F ~ U V^T from S ~ Q V^T: U = A^-1/2 Q and V = A^1/2 V, as rows [n][k] in mesh order. */
static lam_status scale_back(const scaled_matrix *S, const tall_factors *f, float **U, float **V,
                             lam_error *error) {
    const size_t n = f->n, k = f->rank;
    float *u = memory_allocate(n, k * sizeof *u, "operator", error);
    float *v = memory_allocate(n, k * sizeof *v, "operator", error);
    if (u == NULL || v == NULL) {
        free(u);
        free(v);
        return LAM_ERR_MEMORY;
    }
#pragma omp parallel for schedule(static, 64)
    for (size_t p = 0; p < n; p++) {
        const size_t i = S->order[p];
        const double root = S->root_area[i];
        for (size_t c = 0; c < k; c++) {
            u[i * k + c] = (float)((double)f->Q[p * k + c] / root);
            v[i * k + c] = (float)((double)f->V[p * k + c] * root);
        }
    }
    *U = u;
    *V = v;
    return LAM_OK;
}

/* Y = -R' U (I - V^T R U)^-1 (eq. 2.8), where R' has 1 for a reflectance of 0. */
static lam_status fold(const build_problem *problem, size_t k, const float *U, const float *V, float **Y,
                       double *rcond, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n;
    float *core = memory_allocate(k, k * sizeof *core, "core", error);
    float *y = memory_allocate(n, k * sizeof *y, "operator", error);
    if (core == NULL || y == NULL) TRY(LAM_ERR_MEMORY);
    TRY(core_factored(k, n, V, U, problem->reflectance, core, rcond, error));
    if (k > 0)
        cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)n, (int)k, (int)k, -1, U, (int)k, core,
                    (int)k, 0, y, (int)k);
    for (size_t i = 0; i < n; i++) {
        const float rho = problem->reflectance[i];
        if (rho > 0) cblas_sscal((int)k, rho, y + i * k, 1);
    }
    *Y = y;
    y = NULL;
done:
    free(core);
    free(y);
    return status;
}

/* One core per channel over shared U and V. */
static lam_status cores(const build_problem *problem, size_t k, const float *U, const float *V, float **core,
                        double *rcond, lam_error *error) {
    lam_status status = LAM_OK;
    float *c = memory_allocate(problem->n_channels, k * k * sizeof *c, "core", error);
    if (c == NULL) return LAM_ERR_MEMORY;
    *rcond = 1;
    for (size_t channel = 0; channel < problem->n_channels; channel++) {
        double one;
        TRY(core_factored(k, problem->n, V, U, problem->reflectance + channel * problem->n,
                          c + channel * k * k, &one, error));
        *rcond = fmin(*rcond, one);
    }
    *core = c;
    c = NULL;
done:
    free(c);
    return status;
}

static lam_status build(const build_problem *problem, const build_options *options, lam_operator **op,
                        build_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    row_source rows;
    scaled_matrix S = {0};
    tall_factors f = {0};
    float *U = NULL, *V = NULL, *Y = NULL, *core = NULL;
    const size_t n = problem->n;
    const double start = clock_seconds();
    const factorizer_options how = {
        .epsilon = options->epsilon,
        .rank = options->rank,
        .budget = options->budget,
        .levels = options->levels,
        .iterations = -1,
        /* With the rank given, epsilon decides nothing and noise is nothing to it. */
        .noise = options->rank > 0 ? 0 : problem->noise,
        .memory = options->memory,
        .seed = options->seed,
        .progress = options->progress};

    row_source_of_csr(&rows, problem->F);
    TRY(scaled_init(&S, &rows, problem->area, problem->order, error));
    TRY(factorize(options->factorizer, &S, &how, &f, &report->factorized, error));
    const size_t k = f.rank;
    report->factorize_seconds = clock_seconds() - start;

    TRY(norm_of_error(&S, &f, options->progress, &report->measured_norm_error, error));
    const double inverting = clock_seconds();
    progress_report(options->progress, "invert", 0);
    TRY(scale_back(&S, &f, &U, &V, error));
    tall_factors_free(&f);
    if (problem->n_channels == 1) {
        TRY(fold(problem, k, U, V, &Y, &report->rcond, error));
        free(U);
        U = NULL;
        TRY(operator_low_rank_create_folded(n, k, problem->reflectance, Y, V, op, error));
        Y = V = NULL;
    } else {
        TRY(cores(problem, k, U, V, &core, &report->rcond, error));
        TRY(operator_low_rank_create_factored(n, k, problem->n_channels, problem->reflectance, U, V, core, op,
                                              error));
        U = V = core = NULL;
    }
    report->invert_seconds = clock_seconds() - inverting;
    report->method = "low-rank";
    report->factorizer = report->factorized.name;
    report->rank = k;
    report->levels = report->factorized.levels;
    report->epsilon = options->rank > 0 ? report->measured_norm_error : options->epsilon;
done:
    scaled_free(&S);
    tall_factors_free(&f);
    free(U);
    free(V);
    free(Y);
    free(core);
    return status;
}

const build_method build_low_rank = {"low-rank", build};
