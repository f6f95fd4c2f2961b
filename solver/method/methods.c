/* The list of methods and the choice among them. */
#include "solver/method/classify.h"
#include "solver/method/method.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const build_method *const methods[] = {&build_exact,  &build_low_rank, &build_two_mesh,
                                              &build_sparse, &build_emitters, &build_hierarchical};

static lam_status check_options(const build_options *options, lam_error *error) {
    lam_status status = LAM_OK;
    /* 2msc does not factorize, it can make its own columns orthogonal; exact does neither. What a method has
     * no use for is not refused. */
    const bool qr = strcmp(options->factorizer, "qr") == 0;
    const bool factorizes = strcmp(options->method, "auto") == 0 || strcmp(options->method, "low-rank") == 0;
    if (!qr && !factorizer_exists(options->factorizer))
        FAIL(error, LAM_ERR_ARGUMENT, "--factorizer %.40s: unknown; use auto, hf, svd, rsi, sgrsvd or qr",
             options->factorizer);
    if (qr && factorizes)
        FAIL(error, LAM_ERR_ARGUMENT,
             "--factorizer qr: is of --method 2msc alone; --method %.40s cannot use it", options->method);
    if (!(options->coherence >= 0 && options->coherence <= 1))
        FAIL(error, LAM_ERR_ARGUMENT, "--coherence %g: must be above 0 and at most 1", options->coherence);
    if (!(options->min_area >= 0 && options->min_area < INFINITY))
        FAIL(error, LAM_ERR_ARGUMENT, "--min-area %g: must be above 0", options->min_area);
    if (strcmp(options->method, "sparse") == 0 && !(options->threshold > 0 && options->threshold < 1))
        FAIL(error, LAM_ERR_ARGUMENT, "--threshold %g: must be above 0 and below 1", options->threshold);
    if (!(options->epsilon > 0 && options->epsilon <= 1))
        FAIL(error, LAM_ERR_ARGUMENT, "--epsilon %g: must be above 0 and at most 1", options->epsilon);
    if (!(options->budget.alpha > 0 && options->budget.alpha < 1))
        FAIL(error, LAM_ERR_ARGUMENT, "--alpha %g: must be above 0 and below 1", options->budget.alpha);
done:
    return status;
}

/* The numbers of a low-rank operator over those of the exact one: folded Y and V, or U, V and C cores. */
static double low_rank_share(size_t n, size_t rank, size_t n_channels, bool keep_factors) {
    const double k = (double)rank, whole = (double)n * (double)n * (double)n_channels;
    const bool factored = n_channels > 1 || keep_factors;
    return (2 * (double)n * k + (factored ? (double)n_channels * k * k : 0)) / whole;
}

/* Low-rank, or exact where the rank turns out to save nothing. */
static lam_status build_by_rank(const build_problem *problem, const build_options *options,
                                const scene_class *looked, lam_operator **op, build_report *report,
                                lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n;
    lam_operator *low_rank = NULL;
    TRY(build_low_rank.build(problem, options, &low_rank, report, error));
    const size_t rank = report->rank;
    const double share = low_rank_share(n, rank, problem->n_channels, options->keep_factors);
    if (share >= 1 && isfinite(looked->exact_cost)) {
        const double spent = report->factorize_seconds, bound = report->epsilon;
        TRY(build_exact.build(problem, options, op, report, error));
        report->factorize_seconds = spent;
        snprintf(report->reason, sizeof report->reason,
                 "exact: rank %zu of %zu for epsilon %.3g would take more memory than the whole inverse",
                 rank, n, bound);
    } else {
        *op = low_rank;
        low_rank = NULL;
        snprintf(
            report->reason, sizeof report->reason,
            "low-rank: F is %.3g %% dense; rank %zu of %zu, epsilon %.3g, takes %.3g %% of the memory of "
            "the whole inverse",
            100 * looked->density, rank, n, report->epsilon, 100 * share);
    }
done:
    lam_operator_close(low_rank);
    return status;
}

/* auto: what classify.h finds. */
static lam_status build_auto(const build_problem *problem, const build_options *options, lam_operator **op,
                             build_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    scene_class looked;
    lam_operator *hierarchical = NULL;
    build_report made = *report;
    const classify_options look = {.epsilon = options->epsilon,
                                   .threshold = options->threshold,
                                   .memory = options->memory,
                                   .seed = options->seed,
                                   .progress = options->progress,
                                   .hierarchical = &hierarchical,
                                   .hierarchical_report = &made};
    build_problem seen = *problem;
    if (options->low_rank) seen.centre = NULL; /* not to build what is not wanted */
    TRY(classify_scene(&seen, &look, &looked, error));
    if (strcmp(looked.method, "hierarchical") == 0) {
        *op = hierarchical;
        *report = made;
        hierarchical = NULL;
        memcpy(report->reason, looked.reason, sizeof report->reason);
    } else if (strcmp(looked.method, "low-rank") == 0 || options->rank > 0) {
        TRY(build_by_rank(problem, options, &looked, op, report, error));
    } else if (strcmp(looked.method, "sparse") == 0) {
        build_options how = *options;
        how.threshold = looked.threshold;
        TRY(build_sparse.build(problem, &how, op, report, error));
        memcpy(report->reason, looked.reason, sizeof report->reason);
    } else {
        TRY(build_exact.build(problem, options, op, report, error));
        memcpy(report->reason, looked.reason, sizeof report->reason);
    }
done:
    lam_operator_close(hierarchical);
    return status;
}

/* Rows that nobody holds: only a hierarchical operator can be made of them. */
static lam_status build_streamed(const build_problem *problem, const build_options *options,
                                 lam_operator **op, build_report *report, lam_error *error) {
    const char *method = options->method;
    if (strcmp(method, "auto") != 0 && strcmp(method, "hierarchical") != 0)
        return status_fail(error, LAM_ERR_ARGUMENT,
                           "--method %.40s: needs rows of form factors that are held", method);
    return build_hierarchical.build(problem, options, op, report, error);
}

lam_status build_operator(const build_problem *problem, const build_options *options, lam_operator **op,
                          build_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    *report = (build_report){.measured_norm_error = -1,
                             .rcond = 1,
                             .coherence = -1,
                             .patch_area = -1,
                             .residual = -1,
                             .probe_residual = -1,
                             .uniform_error = -1};
    TRY(check_options(options, error));
    if (problem->stream != NULL) {
        TRY(build_streamed(problem, options, op, report, error));
        goto done;
    }
    const bool chosen = strcmp(options->method, "auto") == 0;
    if (chosen && problem->emitters != NULL) {
        TRY(build_emitters.build(problem, options, op, report, error));
        goto done;
    }
    if (chosen) {
        TRY(build_auto(problem, options, op, report, error));
        goto done;
    }
    for (size_t i = 0; i < sizeof methods / sizeof *methods; i++) {
        if (strcmp(options->method, methods[i]->name) != 0) continue;
        TRY(methods[i]->build(problem, options, op, report, error));
        if (report->reason[0] == '\0')
            snprintf(report->reason, sizeof report->reason, "%s: asked for by --method", methods[i]->name);
        goto done;
    }
    FAIL(error, LAM_ERR_ARGUMENT,
         "--method %.40s: unknown; use auto, exact, low-rank, 2msc, sparse, emitters or hierarchical",
         options->method);
done:
    return status;
}
