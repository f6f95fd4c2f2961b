/* Method low-rank: factorizes S, then applies Sherman-Morrison-Woodbury (Aguerre 2016, eq. 2.8) with the
 * areas scaled back. */
#include "solver/base/clock.h"
#include "solver/method/choice.h"
#include "solver/method/low_rank/factorizer.h"
#include "solver/method/low_rank/spectrum.h"
#include "solver/method/norm.h"
#include "solver/method/tall_factors.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const option_row rows[] = {
    {.name = "factorizer",
     .kind = OPTION_CHOICE,
     .offset = offsetof(low_rank_options, factorizer),
     .preset = "auto",
     .choices = METHOD_FACTORIZERS,
     .help = "low-rank: algorithm of the factorization; 2msc: qr makes the columns orthogonal"},
    {.name = "epsilon",
     .kind = OPTION_NUMBER,
     .offset = offsetof(low_rank_options, epsilon),
     .argument = "X",
     .preset = ".05",
     .least = 0,
     .most = 1,
     .above = true},
    {.name = "alpha",
     .kind = OPTION_NUMBER,
     .offset = offsetof(low_rank_options, alpha),
     .argument = "X",
     .preset = ".5",
     .least = 0,
     .most = 1,
     .above = true,
     .below = true,
     .help = "hf: share of the bound that the last step may use"},
    {.name = "levels",
     .kind = OPTION_COUNT_AUTO,
     .offset = offsetof(low_rank_options, levels),
     .argument = "N|auto",
     .preset = "auto",
     .least = 0,
     .most = 20,
     .help = "hf: levels of the factorization"},
    {.name = "rank",
     .kind = OPTION_COUNT,
     .offset = offsetof(low_rank_options, rank),
     .argument = "K",
     .least = 1,
     .most = 4e9,
     .help = "low-rank: exactly K columns in place of --epsilon; 2msc: K patches"},
    {.name = "keep-factors",
     .kind = OPTION_FLAG,
     .offset = offsetof(low_rank_options, keep_factors),
     .help = "low-rank, 2msc: keep the factors of a grey scene free of reflectance, as those of a coloured "
             "scene are, so that lambertd can change materials"},
    {0},
};

/* Coefficients that an answer reads, of all channels: folded Y and V, or U, V and C cores. */
static double cost_of(const build_problem *problem, size_t rank, bool keep_factors) {
    const double n = (double)problem->n, k = (double)rank, C = (double)problem->n_channels;
    return 2 * n * k + (C > 1 || keep_factors ? C * k * k : 0);
}

static lam_status check(const void *own, lam_error *error) {
    const low_rank_options *o = own;
    if (!factorizer_exists(o->factorizer))
        return status_fail(error, LAM_ERR_ARGUMENT, "--factorizer %.40s: goes with --method 2msc only",
                           o->factorizer);
    return LAM_OK;
}

/* The bound of |S - Q V^T| for an epsilon. Where nothing reflects, all that is asked for is the irradiance F
 * E, which is off by that bound over |S|: bodies that see little of each other may have an |S| below epsilon.
 */
static lam_status bound_of(const build_problem *problem, const scaled_matrix *S, double epsilon,
                           const progress *p, double *bound, lam_error *error) {
    const tall_factors none = {.n = problem->n, .m = problem->n};
    double norm = 1;
    *bound = epsilon;
    for (size_t k = 0; k < problem->n * problem->n_channels; k++)
        if (problem->reflectance[k] > 0) return LAM_OK;
    const lam_status status = norm_of_error(S, &none, p, &norm, error);
    if (status == LAM_OK && norm > 0 && norm < 1) *bound = epsilon * norm;
    return status;
}

static lam_status build(const build_problem *problem, const build_options *options, const void *own,
                        lam_operator **op, build_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    const low_rank_options *o = own;
    row_source rows_of_F;
    scaled_matrix S = {0};
    tall_factors f = {0};
    factorizer_report factorized = {.name = NULL};
    double norm, rcond, bound;
    const double start = clock_seconds();
    factorizer_options how = {.epsilon = o->epsilon,
                              .rank = (size_t)o->rank,
                              .budget = {.alpha = o->alpha},
                              .levels = o->levels == OPTION_AUTO ? -1 : (int)o->levels,
                              .iterations = -1,
                              /* With the rank given, epsilon decides nothing and noise is nothing to it. */
                              .noise = o->rank > 0 ? 0 : problem->noise,
                              .memory = options->memory,
                              .seed = options->seed,
                              .progress = options->progress};

    TRY(check(o, error));
    row_source_of_csr(&rows_of_F, problem->F);
    TRY(scaled_init(&S, &rows_of_F, problem->area, problem->order, error));
    TRY(bound_of(problem, &S, o->epsilon, options->progress, &bound, error));
    how.epsilon = bound;
    TRY(factorize(o->factorizer, &S, &how, &f, &factorized, error));
    const size_t k = f.rank;
    report_step_add(report, "factorize", clock_seconds() - start);
    TRY(norm_of_error(&S, &f, options->progress, &norm, error));
    const double inverting = clock_seconds();
    progress_report(options->progress, "invert", 0);
    TRY(operator_of_factors(problem, &S, &f, o->keep_factors, op, &rcond, error));
    report_step_add(report, "invert", clock_seconds() - inverting);

    report_text(report, "factorizer", factorized.name);
    report_number(report, "epsilon", o->rank > 0 ? norm : bound);
    report_number(report, "rcond", rcond);
    report_count(report, "levels", factorized.levels);
    report_number(report, "passes", factorized.passes);
    if (factorized.levels > 0 && o->rank == 0) {
        report_text(report, "budget", "squares");
        report_number(report, "alpha", o->alpha);
    }
    report_count(report, "rank", (double)k);
    norm_report(problem, norm, report);
    report->cost = cost_of(problem, k, o->keep_factors);
    report->below_noise = o->rank == 0 && bound < problem->noise;
    const double whole = (double)problem->n * (double)problem->n * (double)problem->n_channels;
    snprintf(report->detail, sizeof report->detail,
             "rank %zu of %zu, bound %.3g, %.3g %% of the memory of the whole inverse", k, problem->n,
             o->rank > 0 ? norm : bound, 100 * report->cost / whole);
done:
    scaled_free(&S);
    tall_factors_free(&f);
    return status;
}

/* A rank takes the place of the bound, and only hf has steps. */
static bool ignores(const void *own, const build_report *report, const char *option) {
    const low_rank_options *o = own;
    const bool bound = strcmp(option, "epsilon") == 0 || strcmp(option, "alpha") == 0;
    const bool steps = strcmp(option, "levels") == 0 || strcmp(option, "alpha") == 0;
    return (o->rank > 0 && bound) || (steps && !report_is(report, "factorizer", factorizer_hf.name));
}

/* Leaf blocks and both factors of two nodes; about 1,024 columns where their number is not known yet. */
static void forecast(const method_scale *scale, const void *own, method_forecast *out) {
    const low_rank_options *o = own;
    const double n = scale->n, k = o->rank > 0 ? fmin((double)o->rank, n) : fmin(1024, n);
    *out = (method_forecast){
        .building = 4 * n * (2 * fmin(1024, n) + 6 * k), .loaded = 8 * n * k, .stored = 8 * n * k};
}

static bool is_asked(const build_options *options, const void *own) {
    const low_rank_options *o = own;
    return o->rank > 0 || o->keep_factors || strcmp(o->factorizer, "auto") != 0 ||
           strcmp(options->precision, "f32") != 0;
}

/* The cost, 2 n k, from an estimate of the spectrum of S. The rank for a bound on |S - Q V^T| does not bound
 * the error of single elements, so an operator that was built and keeps epsilon for these too is preferred.
 */
static lam_status weigh(const decision *so_far, void *own, candidate *out, lam_error *error) {
    lam_status status = LAM_OK;
    const build_problem *p = so_far->problem;
    const low_rank_options *o = own;
    const double n = (double)p->n;
    row_source rows_of_F;
    scaled_matrix S = {0};
    spectrum values = {0};
    double bound;
    out->object = "rank";
    if (o->rank > 0) {
        out->claim = CLAIM_OPTIONS;
        out->cost = 2 * n * fmin((double)o->rank, n);
    }
    if (p->F == NULL && out->claim == CLAIM_COST && so_far->asked == out->method) out->claim = CLAIM_USUAL;
    for (size_t k = 0; k < so_far->n_candidates; k++)
        out->outdone =
            out->outdone || (so_far->candidates[k].op != NULL && isfinite(so_far->candidates[k].cost));
    /* No other method can be had of a dense F where the whole inverse is too large. */
    const bool rivals = so_far->density < 1 / CHOICE_SCATTERED || isfinite(decision_rival(so_far));
    const bool open = rivals && !out->outdone && !decision_claimed(so_far) && out->claim == CLAIM_COST;
    if (p->F == NULL || !(open || so_far->thorough)) goto done;
    row_source_of_csr(&rows_of_F, p->F);
    TRY(scaled_init(&S, &rows_of_F, p->area, p->order, error));
    TRY(spectrum_find(&S, SPECTRUM_STEPS, so_far->options->seed, so_far->options->progress, &values, error));
    TRY(bound_of(p, &S, o->epsilon, so_far->options->progress, &bound, error));
    const double rank = spectrum_rank(&values, bound);
    out->left = sqrt(spectrum_left(&values, bound));
    if (2 * n * rank <= so_far->most) out->cost = 2 * n * rank;
    candidate_figure(out, "epsilon", o->epsilon);
    candidate_figure(out, "estimate", rank);
    candidate_figure(out, "share", rank / n);
    snprintf(out->found, sizeof out->found, "rank estimate %.0f at epsilon %.3g, %.3g %% of the elements",
             rank, o->epsilon, 100 * rank / n);
done:
    spectrum_free(&values);
    scaled_free(&S);
    return status;
}

const build_method method_low_rank = {
    .name = "low-rank",
    .summary = "factors of rank k; dense scenes, materials that change",
    .kind = &operator_low_rank,
    .rows = rows,
    .check = check,
    .ignores = ignores,
    .forecast = forecast,
    .is_asked = is_asked,
    .weigh = weigh,
    .build = build,
};
_Static_assert(sizeof(low_rank_options) <= METHOD_OPTIONS_BYTES, "they fit");
