/* low-rank: factorize S, then Sherman-Morrison-Woodbury (thesis eq. 2.8) with the areas scaled back. */
#include "solver/base/clock.h"
#include "solver/method/low_rank/factorizer.h"
#include "solver/method/low_rank/fold_factors.h"
#include "solver/method/low_rank/norm.h"
#include "solver/method/method.h"

static lam_status build(const build_problem *problem, const build_options *options, lam_operator **op,
                        build_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    row_source rows;
    scaled_matrix S = {0};
    tall_factors f = {0};
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

    /* In the norm of the bound, if there is one: a rank that was given leaves what it leaves. */
    if (options->rank == 0) report->norm = budget_norm(options->budget.rule);
    if (report->norm == TRUNCATION_FROBENIUS)
        TRY(norm_of_error_frobenius(&S, &f, &report->measured_norm_error, error));
    else
        TRY(norm_of_error(&S, &f, options->progress, &report->measured_norm_error, error));
    const double inverting = clock_seconds();
    progress_report(options->progress, "invert", 0);
    TRY(finish_low_rank(problem, &S, &f, options->keep_factors, op, &report->rcond, error));
    report->invert_seconds = clock_seconds() - inverting;
    report->method = "low-rank";
    report->factorizer = report->factorized.name;
    report->rank = k;
    report->levels = report->factorized.levels;
    report->epsilon = options->rank > 0 ? report->measured_norm_error : options->epsilon;
done:
    scaled_free(&S);
    tall_factors_free(&f);
    return status;
}

const build_method build_low_rank = {"low-rank", build};
