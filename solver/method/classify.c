#include "solver/method/classify.h"

#include "solver/method/sparse/sparse_inverse.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* An entry of a sparse inverse and its column are two numbers, and what they are multiplied with lies
 * anywhere: measured, four times the time of a number of a panel. */
static const double sparse_number = 4;

/* What the transforms of a hierarchical operator cost, an element; its entries cost what sparse ones do. */
static const double transform_numbers = 40;

/* A low-rank operator of k columns has 2 n k numbers; k beyond n / 2 is no use, and a sparse inverse is at
 * least about as dense as F. */
static const double dense_enough = 1. / sparse_number;

/* Factorizers keep their bound everywhere and so more than they must: their error is about this part of it.
 */
static const double bound_reached = .7;

/* Thresholds of a sparse inverse that are tried, and from one to the next. */
static const double threshold_first = 1e-2, threshold_last = 1e-6, threshold_step = .3162277660168379;

double classify_rank(const spectrum *values, double epsilon) {
    return fmax(1, spectrum_above(values, bound_reached * epsilon));
}

static lam_status look_at_rank(const build_problem *p, const classify_options *options, scene_class *out,
                               lam_error *error) {
    lam_status status = LAM_OK;
    row_source rows;
    scaled_matrix S = {0};
    spectrum values = {0};
    row_source_of_csr(&rows, p->F);
    TRY(scaled_init(&S, &rows, p->area, p->order, error));
    TRY(spectrum_find(&S, CLASSIFY_STEPS, options->seed, options->progress, &values, error));
    out->rank = classify_rank(&values, options->epsilon);
    out->tail = sqrt(spectrum_tail(&values, bound_reached * options->epsilon));
done:
    spectrum_free(&values);
    scaled_free(&S);
    return status;
}

/* What is left out over what may be: of light from everywhere epsilon, which is what low-rank and
 * hierarchical operators keep to; of single elements epsilon too, or, where its rival is of low rank, as much
 * as that leaves out. */
static double excess(const sparse_sample *sample, const scene_class *c, double epsilon) {
    const double single = isfinite(c->hierarchical_cost) ? epsilon : fmax(c->tail, epsilon);
    return fmax(sample->single / single, sample->everywhere / epsilon);
}

/* The largest of some thresholds at which truncation alone leaves out no more than may be; 0: none. */
static double optimistic_threshold(const inverse_rows *truth, const scene_class *c, double epsilon,
                                   double entries_most) {
    for (double threshold = threshold_first; threshold > threshold_last; threshold *= threshold_step) {
        const sparse_sample sample = inverse_rows_truncated(truth, threshold);
        if (sample.entries > entries_most) return 0;
        if (excess(&sample, c, epsilon) <= 1) return threshold;
    }
    return 0;
}

/* From the threshold that truncation alone would allow, down until a sparse inverse leaves out no more, or
 * until its entries are no use; between two thresholds both are taken to be powers of it. */
static lam_status look_at_inverse(const build_problem *p, const classify_options *options,
                                  double entries_most, scene_class *out, lam_error *error) {
    lam_status status = LAM_OK;
    inverse_rows truth = {.rows = NULL};
    sparse_sample sample;
    const bool given = options->threshold > 0;
    double threshold = options->threshold, last_entries = 0, last_excess = 0;
    TRY(inverse_rows_find(p, p->reflectance, options->progress, &truth, error));
    if (!given) threshold = optimistic_threshold(&truth, out, options->epsilon, entries_most);
    while (threshold >= threshold_last) {
        if (progress_cancelled(options->progress)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
        TRY(sparse_inverse_sample(p, p->reflectance, threshold, &truth, &sample, error));
        const double now = excess(&sample, out, options->epsilon);
        if (given || now <= 1) {
            out->threshold = threshold;
            out->entries = sample.entries;
            if (last_entries > 0 && now > 0) {
                const double part = log(last_excess) / log(last_excess / now);
                out->threshold = threshold / threshold_step * pow(threshold_step, part);
                out->entries = last_entries * pow(sample.entries / last_entries, part);
            }
            break;
        }
        if (sample.entries > entries_most) break;
        last_excess = now;
        last_entries = sample.entries;
        threshold *= threshold_step;
    }
done:
    inverse_rows_free(&truth);
    return status;
}

/* The hierarchical operator itself: nothing cheaper tells how much of it there is. */
static lam_status look_at_hierarchical(const build_problem *p, const classify_options *options,
                                       scene_class *out, lam_error *error) {
    lam_status status = LAM_OK;
    const build_options how = {.method = "hierarchical",
                               .factorizer = "auto",
                               .epsilon = options->epsilon,
                               .budget = {.rule = BUDGET_SQUARES, .alpha = .5},
                               .seed = options->seed,
                               .progress = options->progress};
    const double n = (double)p->n;
    lam_operator *op = NULL;
    build_report report =
        options->hierarchical != NULL ? *options->hierarchical_report : (build_report){.method = NULL};
    operator_description about = {.density = -1};
    TRY(build_hierarchical.build(p, &how, &op, &report, error));
    operator_describe(op, &about);
    out->numbers = about.density * n;
    if (options->memory == 0 || lam_operator_bytes(op) <= options->memory)
        out->hierarchical_cost = (sparse_number * out->numbers + transform_numbers) * n;
    if (options->hierarchical != NULL) {
        *options->hierarchical = op;
        *options->hierarchical_report = report;
        op = NULL;
    }
done:
    lam_operator_close(op);
    return status;
}

/* Few elements keep the whole inverse, whatever they see. */
static bool is_small(const scene_class *c) {
    return c->n <= CLASSIFY_SMALL && isfinite(c->exact_cost);
}

/* A rank says nothing of the light of single elements: where there is a hierarchical operator, that and not
 * low rank is what others must be faster than. */
static void choose(scene_class *c, bool emitters) {
    const bool hierarchical = isfinite(c->hierarchical_cost);
    const double rival = hierarchical ? c->hierarchical_cost : c->low_rank_cost;
    c->method = hierarchical ? "hierarchical" : "low-rank";
    if (c->exact_cost <= rival && isfinite(c->exact_cost)) c->method = "exact";
    if (c->sparse_cost < fmin(c->exact_cost, rival)) c->method = "sparse";
    if (is_small(c)) c->method = "exact";
    if (emitters) c->method = "emitters";
}

static void say(scene_class *c, double epsilon) {
    char rank[64] = "";
    if (is_small(c) && strcmp(c->method, "exact") == 0) {
        snprintf(c->reason, sizeof c->reason,
                 "exact: %zu elements are few enough (up to %d) to keep the whole inverse", c->n,
                 CLASSIFY_SMALL);
        return;
    }
    if (c->rank >= 0) snprintf(rank, sizeof rank, ", rank estimate %.0f at epsilon %.3g", c->rank, epsilon);
    if (strcmp(c->method, "hierarchical") == 0)
        snprintf(rank, sizeof rank, ", %.3g numbers an element at epsilon %.3g", c->numbers, epsilon);
    int n =
        snprintf(c->reason, sizeof c->reason, "%s: F is %.3g %% dense%s", c->method, 100 * c->density, rank);
    const struct {
        const char *method;
        double cost;
    } all[] = {{"exact", c->exact_cost},
               {"low-rank", c->low_rank_cost},
               {"sparse", c->sparse_cost},
               {"hierarchical", c->hierarchical_cost},
               {"emitters", c->emitters_cost}};
    enum { ALL = sizeof all / sizeof *all };
    double own = INFINITY;
    for (size_t k = 0; k < ALL; k++)
        if (strcmp(all[k].method, c->method) == 0) own = all[k].cost;
    for (size_t k = 0; k < ALL && isfinite(own); k++)
        if (all[k].cost > own && isfinite(all[k].cost) && n > 0 && (size_t)n < sizeof c->reason)
            n += snprintf(c->reason + n, sizeof c->reason - (size_t)n, "; %s would take %.3g times as long",
                          all[k].method, all[k].cost / own);
}

lam_status classify_scene(const build_problem *problem, const classify_options *options, scene_class *out,
                          lam_error *error) {
    lam_status status = LAM_OK;
    const double n = (double)problem->n, C = (double)problem->n_channels,
                 numbers = options->memory > 0 ? (double)options->memory / sizeof(float) : INFINITY;
    scene_class c = {.n = problem->n,
                     .density = (double)problem->F->indptr[problem->n] / (n * n),
                     .rank = -1,
                     .tail = -1,
                     .entries = -1,
                     .threshold = options->threshold,
                     .exact_cost = INFINITY,
                     .low_rank_cost = INFINITY,
                     .sparse_cost = INFINITY,
                     .emitters_cost = INFINITY,
                     .hierarchical_cost = INFINITY,
                     .numbers = -1};
    if (problem->n <= CLASSIFY_EXACT_MOST && C * n * n <= numbers) c.exact_cost = n * n;
    if (problem->emitters != NULL) c.emitters_cost = n * (double)problem->emitters->s;
    const bool decided = problem->emitters != NULL || is_small(&c), open = c.density < dense_enough;
    if ((!decided || options->thorough) && problem->centre != NULL && problem->normal != NULL)
        TRY(look_at_hierarchical(problem, options, &c, error));
    const bool hierarchical = isfinite(c.hierarchical_cost),
               noisy = problem->noise > options->epsilon && options->threshold == 0;
    const bool sparse_too = open && (!decided || options->thorough) && !(hierarchical && noisy);
    /* Where the whole inverse may be the answer the rank decides; else it decides only against sparse. */
    const bool whole = isfinite(c.exact_cost) && !decided;
    if (options->thorough || (!hierarchical && (sparse_too || whole))) {
        TRY(look_at_rank(problem, options, &c, error));
        if (2 * n * c.rank <= numbers) c.low_rank_cost = 2 * n * c.rank;
    }
    if (sparse_too) {
        const double rival = fmin(c.exact_cost, hierarchical ? c.hierarchical_cost : c.low_rank_cost);
        TRY(look_at_inverse(problem, options, fmin(rival / sparse_number, numbers / 2 / C), &c, error));
        if (c.entries >= 0 && 2 * C * c.entries <= numbers) c.sparse_cost = sparse_number * c.entries;
    }
    choose(&c, problem->emitters != NULL);
    say(&c, options->epsilon);
    *out = c;
done:
    return status;
}
