#include "solver/bench/formfactors.h"
#include "solver/bench/formfactors_truths.h"
#include "solver/bench/stats.h"

#include <math.h>
#include <stdlib.h>

static const table_column columns[] = {
    {"case", NULL, "the configuration"},
    {"source", NULL, "of the truth"},
    {"method", NULL, "how the form factor was found"},
    {"occluded", "", "1: wholly or partly hidden"},
    {"truth", "", "F"},
    {"estimate", "", "F with the first seed"},
    {"absolute_error", "", "of the first seed"},
    {"relative_error", "", "of the first seed"},
    {"stated_bar", "",
     "what the error may be: two standard errors, or the tolerance where nothing is sampled"},
    {"repeats", "", "seeds"},
    {"covered", "", "share of the seeds whose error was within the bar stated with it"},
    {"worst_error", "", "largest absolute error of all seeds"},
    {"seconds", "s", "median of all seeds"},
};

static const table_column summary_columns[] = {
    {"method", NULL, "how the form factor was found"},
    {"open_worst", "", "largest relative error of the first seed, nothing between"},
    {"open_median", "", "median of the same"},
    {"hidden_worst", "", "largest relative error of the first seed, something between"},
    {"zero_worst", "", "largest F of all seeds where nothing can pass"},
    {"covered", "", "share of all seeds whose error was within the bar stated with it"},
    {"seconds", "s", "median of a case"},
};

enum { METHODS_MOST = 6, SEEDS_MOST = 21, CASES_MOST = 64 };

/* What all cases of one method come to. */
typedef struct method_summary {
    double open[CASES_MOST], seconds[CASES_MOST], open_F[CASES_MOST];
    size_t n_open, n_cases, n_runs, n_covered;
    double hidden_worst, zero_worst;
} method_summary;

/* The bar of an estimate F_ij, by what the method says of itself and what a user knows.
 * Rays: two standard errors of independent rays. Of the counts c_ij and c_ji of N rays each,
 *     F = (c_ij + c_ji) / N * A_j / (A_i + A_j)
 * so the variance is [F_ij (1 - F_ij) + F_ji (1 - F_ji)] / N * (A_j / (A_i + A_j))^2; the points of a
 * low-discrepancy sequence do better. Pairs: two of the accuracy reached where something is hidden, else the
 * relative tolerance of the mathematics. A hemicube states nothing. */
static double stated_bar(const recipe *how, const form_factors *f, const mesh *m, const formfactors_truth *t,
                         double F) {
    static const double pairs_tolerance = 1e-6;
    const double a = m->area[t->from], b = m->area[t->to], back = fmin(1, F * a / b);
    if (how->method == RECIPE_RAYS)
        return 2 * sqrt((F * (1 - F) + back * (1 - back)) / (double)how->rays) * b / (a + b);
    if (how->method == RECIPE_PAIRS) return t->occluded ? 2 * f->pairs.accuracy : pairs_tolerance * F;
    return NAN;
}

static lam_status measure(const bench_run *run, const formfactors_truth *t, recipe how, size_t seeds,
                          table *out, method_summary *sum, lam_error *error) {
    lam_status status = LAM_OK;
    mesh m = {0};
    uint32_t *order = NULL;
    form_factors f = {.row_sums = NULL};
    double first = 0, first_bar = NAN, worst = 0, seconds[SEEDS_MOST];
    size_t covered = 0;
    char method[64];
    TRY(scene_of_pieces(t->pieces, t->n, &m, error));
    TRY(formfactors_order(&m, &order, error));
    if (how.method == RECIPE_HEMICUBE) seeds = 1;
    for (size_t s = 0; s < seeds; s++) {
        how.seed = run->seed + s;
        TRY(formfactors_make_timed(run, &m, order, &how, "closed forms", &f, &seconds[s], error));
        const double F = formfactors_entry(&f.F, t->from, t->to), bar = stated_bar(&how, &f, &m, t, F);
        if (s == 0) first = F, first_bar = bar;
        worst = fmax(worst, fabs(F - t->F));
        covered += fabs(F - t->F) <= bar;
        form_factors_free(&f);
    }
    recipe_describe(&how, method);
    const double wrong = fabs(first - t->F), relative = t->F > 0 ? wrong / t->F : NAN;
    const double median = stats_median(seconds, seeds);
    table_text(out, t->name);
    table_text(out, t->source);
    table_text(out, method);
    table_number(out, t->occluded);
    table_number(out, t->F);
    table_number(out, first);
    table_number(out, wrong);
    table_number(out, relative);
    table_number(out, first_bar);
    table_number(out, (double)seeds);
    table_number(out, isfinite(first_bar) ? (double)covered / (double)seeds : NAN);
    table_number(out, worst);
    table_number(out, median);

    sum->seconds[sum->n_cases++] = median;
    if (t->F == 0)
        sum->zero_worst = fmax(sum->zero_worst, worst);
    else if (t->occluded)
        sum->hidden_worst = fmax(sum->hidden_worst, relative);
    else {
        sum->open_F[sum->n_open] = t->F;
        sum->open[sum->n_open++] = relative;
    }
    if (isfinite(first_bar)) {
        sum->n_runs += seeds;
        sum->n_covered += covered;
    }
done:
    form_factors_free(&f);
    free(order);
    mesh_free(&m);
    return status;
}

static void summarize(const recipe *how, method_summary *sum, table *out) {
    char method[64];
    double sorted[CASES_MOST];
    for (size_t i = 0; i < sum->n_open; i++) sorted[i] = sum->open[i];
    recipe_describe(how, method);
    table_text(out, method);
    table_number(out, stats_quantile(sorted, sum->n_open, 1));
    table_number(out, stats_median(sorted, sum->n_open));
    table_number(out, sum->hidden_worst);
    table_number(out, sum->zero_worst);
    table_number(out, sum->n_runs > 0 ? (double)sum->n_covered / (double)sum->n_runs : NAN);
    table_number(out, stats_median(sum->seconds, sum->n_cases));
}

lam_status formfactors_closed_forms(const bench_run *run, lam_error *error) {
    lam_status status = LAM_OK;
    const recipe all[METHODS_MOST] = {formfactors_rays(4096, 0),  formfactors_rays(65536, 0),
                                      formfactors_hemicube(64),   formfactors_hemicube(512),
                                      formfactors_pairs(7e-5, 0), formfactors_pairs(7e-6, 0)};
    const recipe few[] = {all[0], all[2], all[4]};
    const bool quick = run->scale == BENCH_QUICK;
    const recipe *methods = quick ? few : all;
    const size_t n_methods = quick ? sizeof few / sizeof *few : METHODS_MOST;
    const size_t seeds = quick ? 2 : run->scale == BENCH_FULL ? SEEDS_MOST : 6;
    table cases = {.name = "closed-forms",
                   .title = "Closed forms: every configuration",
                   .columns = columns,
                   .n_columns = sizeof columns / sizeof *columns};
    table summary = {.name = "closed-forms-summary",
                     .title = "Closed forms: relative error of F by method",
                     .columns = summary_columns,
                     .n_columns = sizeof summary_columns / sizeof *summary_columns,
                     .printed = true};
    char labels[METHODS_MOST][64];
    plot_series series[METHODS_MOST];
    method_summary *sums = memory_allocate(n_methods, sizeof *sums, "closed forms", error);
    if (sums == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n_methods; k++) {
        for (size_t c = 0; formfactors_truths[c].name != NULL && c < CASES_MOST; c++)
            TRY(measure(run, &formfactors_truths[c], methods[k], seeds, &cases, &sums[k], error));
        summarize(&methods[k], &sums[k], &summary);
        recipe_describe(&methods[k], labels[k]);
        series[k] =
            (plot_series){.label = labels[k], .n = sums[k].n_open, .x = sums[k].open_F, .y = sums[k].open};
    }
    TRY(bench_table(run, &cases, error));
    TRY(bench_table(run, &summary, error));
    const plot picture = {.name = "closed-forms",
                          .title = "Form factors with nothing between, against their closed forms",
                          .x_label = "form factor",
                          .y_label = "relative error",
                          .x_log = true,
                          .y_log = true,
                          .series = series,
                          .n_series = n_methods};
    TRY(run->sink->plot(run->sink->context, &picture, error));
done:
    table_free(&cases);
    table_free(&summary);
    free(sums);
    return status;
}
