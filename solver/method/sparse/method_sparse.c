/* sparse: for scenes that hide most of themselves, where F has few entries and no low rank (Aguerre 2016,
 * chapter 4). */
#include "solver/base/clock.h"
#include "solver/linalg/csr_parts.h"
#include "solver/method/choice.h"
#include "solver/method/reference.h"
#include "solver/method/sparse/sparse_inverse.h"
#include "solver/operator/sparse.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Residual of the solution with uniform emission that delta is measured by. */
static const double delta_tolerance = 1e-7;
/* Factor by which a threshold rises at a time where memory is too small; error of its forecast. */
static const double rise = 1.25, doubt = 1.15;

/* An entry is held twice, in the rows and, transposed, in the columns; each time it is an index and a
 * value. */
enum { ENTRY_BYTES = 2 * (sizeof(uint32_t) + sizeof(float)) };

static const option_row rows[] = {
    {.name = "threshold",
     .kind = OPTION_NUMBER,
     .offset = offsetof(sparse_options, threshold),
     .argument = "X",
     .otherwise = "1e-4; under --method auto as --epsilon needs it",
     .most = 1,
     .above = true,
     .below = true,
     .help = "Entries below X are discarded"},
    {.name = "correction",
     .kind = OPTION_WORD,
     .offset = offsetof(sparse_options, correction),
     .preset = "delta",
     .choices = "none|delta|discarded",
     .help = "Correction for discarded entries: none; the error of one solution with uniform emission; "
             "their sum, without its further bounces (Aguerre 2016, eq. 4.7)"},
    {0},
};

static const char *const correction_names[] = {"none", "delta", "discarded"};

/* The threshold where none is given. */
static const double usual_threshold = 1e-4;

/* The smallest threshold from that asked for on whose entries memory is forecast to hold, of all channels;
 * where it does not hold them at that one, rows of black elements are as the others. */
static lam_status fitting_limits(const build_problem *problem, size_t memory, sparse_limits *limits,
                                 lam_error *error) {
    lam_status status = LAM_OK;
    for (double needed = INFINITY; memory > 0 && needed > (double)memory;) {
        needed = 0;
        for (size_t c = 0; c < problem->n_channels; c++) {
            double entries;
            TRY(sparse_inverse_forecast(problem, problem->reflectance + c * problem->n, limits, &entries,
                                        error));
            needed += doubt * entries * ENTRY_BYTES;
        }
        if (needed > (double)memory && limits->whole_black)
            limits->whole_black = false;
        else if (needed > (double)memory)
            limits->threshold *= rise;
        if (limits->threshold >= 1)
            FAIL(error, LAM_ERR_MEMORY, "--method sparse: no --threshold below 1 fits into --memory");
    }
done:
    return status;
}

/* delta_p = sum_j (P - P~)_pj, from one solution with E = 1: exact for light that is everywhere the same. Of
 * a black element from which nothing was discarded it is 0, without rounding. */
static lam_status find_delta(const build_problem *problem, const float *rho, const sparse_inverse *inverse,
                             float *delta, const progress *told, lam_error *error) {
    const csr *M = &inverse->M;
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
        const bool whole = !(rho[i] > 0) && inverse->discarded[p] == 0;
        delta[p] = whole ? 0 : (float)(bounced - kept);
    }
done:
    reference_destroy(r);
    free(E);
    free(B);
    return status;
}

/* Weights of the mean of E: areas, or, as in Aguerre 2016, the same for every element; in each of the parts
 * of the scene between which F has no entry, and which get no light of each other. */
static lam_status set_weights(const build_problem *problem, sparse_correction correction,
                              sparse_arrays *arrays, size_t *n_parts, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n;
    double *sums = NULL;
    uint32_t *of_element = memory_allocate(n, sizeof *of_element, "operator", error);
    arrays->part = memory_allocate(n, sizeof *arrays->part, "operator", error);
    if (of_element == NULL || arrays->part == NULL) TRY(LAM_ERR_MEMORY);
    csr_parts(problem->F, of_element, n_parts);
    sums = memory_allocate(*n_parts, sizeof *sums, "operator", error);
    if (sums == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) sums[of_element[i]] += correction == SPARSE_DELTA ? problem->area[i] : 1;
    for (size_t p = 0; p < n; p++) {
        const uint32_t i = problem->order[p], part = of_element[i];
        arrays->part[p] = part;
        arrays->weight[p] = (float)((correction == SPARSE_DELTA ? problem->area[i] : 1) / sums[part]);
    }
    if (*n_parts == 1) {
        free(arrays->part);
        arrays->part = NULL;
    }
done:
    free(of_element);
    free(sums);
    return status;
}

static lam_status build(const build_problem *problem, const build_options *options, const void *own,
                        lam_operator **op, build_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = problem->n, C = problem->n_channels;
    const double started = clock_seconds();
    sparse_inverse inverse = {.bounces = 0};
    sparse_arrays arrays = {.M = memory_allocate(C, sizeof *arrays.M, "operator", error)};
    lam_operator *made = NULL;
    const sparse_options *o = own;
    const sparse_correction correction = o->correction;

    const double asked = o->threshold > 0 ? o->threshold : usual_threshold;
    sparse_limits limits = {.threshold = asked, .whole_black = true};
    double entries = 0;
    size_t bounces = 0, left = options->memory, n_parts = 1;
    if (arrays.M == NULL) TRY(LAM_ERR_MEMORY);
    if (correction != SPARSE_NONE) {
        arrays.delta = memory_allocate(n, C * sizeof *arrays.delta, "operator", error);
        arrays.weight = memory_allocate(n, sizeof *arrays.weight, "operator", error);
        if (arrays.delta == NULL || arrays.weight == NULL) TRY(LAM_ERR_MEMORY);
        TRY(set_weights(problem, correction, &arrays, &n_parts, error));
    }
    TRY(fitting_limits(problem, options->memory, &limits, error));
    for (size_t c = 0; c < C; c++) {
        const float *rho = problem->reflectance + c * n;
        TRY(sparse_inverse_rows(problem, rho, &limits, left / 2, options->progress, &inverse, error));
        if (correction == SPARSE_DELTA)
            TRY(find_delta(problem, rho, &inverse, arrays.delta + c * n, options->progress, error));
        arrays.M[c] = inverse.M;
        inverse.M = (csr){.n = 0};
        const size_t stored = (size_t)arrays.M[c].indptr[n];
        entries += (double)stored;
        if (left > 0) left -= stored * ENTRY_BYTES;
        if (inverse.bounces > bounces) bounces = inverse.bounces;
        if (correction == SPARSE_DISCARDED)
            for (size_t p = 0; p < n; p++) arrays.delta[c * n + p] = (float)inverse.discarded[p];
        sparse_inverse_free(&inverse);
    }
    TRY(operator_sparse_create(n, C, problem->reflectance, &arrays, &made, error));
    TRY(operator_set_order(made, problem->order, error));
    report_number(report, "threshold", limits.threshold);
    report_text(report, "correction", correction_names[correction]);
    report_step_add(report, "invert", clock_seconds() - started);
    snprintf(report->detail, sizeof report->detail, "threshold %.3g, %.3g %% of all entries, %zu bounces%s",
             limits.threshold, 100 * entries / ((double)n * (double)n * (double)C), bounces,
             limits.threshold > asked ? ", the threshold raised to fit into --memory" : "");
    *op = made;
    made = NULL;
done:
    sparse_inverse_free(&inverse);
    sparse_arrays_free(&arrays, C);
    lam_operator_close(made);
    return status;
}

/* The threshold rises until its entries fit. */
static void forecast(const method_scale *scale, const void *own, method_forecast *out) {
    (void)scale;
    (void)own;
    *out = (method_forecast){.building = 0};
}

/* Thresholds that are tried, and from one to the next. */
static const double threshold_first = 1e-2, threshold_last = 1e-6, threshold_step = .3162277660168379;

/* The error of a sample over the error allowed: of uniform emission and of groups epsilon, which operators of
 * low rank and hierarchical ones keep to; of single elements, as they receive and as they emit, `single`:
 * epsilon or, if that is more, as much as another method leaves out (weigh). */
static double excess(const sparse_sample *sample, double epsilon, double single) {
    return fmax(fmax(sample->single, sample->errors.single) / single,
                fmax(sample->everywhere, sample->errors.groups) / epsilon);
}

/* The largest threshold at which truncation alone leaves out no more of rows than is allowed; 0: none. */
static double optimistic_threshold(const inverse_rows *truth, double epsilon, double single,
                                   double entries_most) {
    for (double threshold = threshold_first; threshold > threshold_last; threshold *= threshold_step) {
        const sparse_sample sample = inverse_rows_truncated(truth, threshold);
        if (sample.entries > entries_most) return 0;
        if (excess(&sample, epsilon, single) <= 1) return threshold;
    }
    return 0;
}

/* From the threshold that truncation alone would allow, down until a sparse inverse leaves out no more than
 * is allowed, or has too many entries; between two thresholds both are taken to be powers of it. *entries
 * stays negative where there is none. A threshold that was given is only sampled. out gets the
 * rows that it was measured by, and its errors. */
static lam_status find_threshold(const decision *d, double single, double entries_most, double *threshold,
                                 double *entries, candidate *out, lam_error *error) {
    lam_status status = LAM_OK;
    const build_problem *p = d->problem;
    const bool given = *threshold > 0;
    const double epsilon = d->options->epsilon;
    sparse_sample sample;
    double tried = *threshold, last_entries = 0, last_excess = 0;
    TRY(inverse_rows_find(p, p->reflectance, d->options->progress, &out->truth, error));
    if (!given) tried = optimistic_threshold(&out->truth, epsilon, single, entries_most);
    while (tried >= threshold_last) {
        if (progress_cancelled(d->options->progress)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
        const sparse_limits limits = {.threshold = tried, .whole_black = true};
        TRY(sparse_inverse_sample(p, p->reflectance, &limits, &out->truth, &sample, error));
        const double now = excess(&sample, epsilon, single);
        if (given || now <= 1) {
            *threshold = tried;
            *entries = sample.entries;
            out->errors = sample.errors;
            if (last_entries > 0 && now > 0) {
                const double part = log(last_excess) / log(last_excess / now);
                *threshold = tried / threshold_step * pow(threshold_step, part);
                *entries = last_entries * pow(sample.entries / last_entries, part);
            }
            break;
        }
        if (sample.entries > entries_most) break;
        last_excess = now;
        last_entries = sample.entries;
        tried *= threshold_step;
    }
done:
    return status;
}

/* Estimates the threshold that keeps the error to epsilon, and the entries that are left, from some rows
 * of sparse inverses. A dense F has no useful sparse inverse; where the noise of F is above epsilon, an
 * inverse of it is noise, and a method that filters the noise is better.
 *
 * The methods c before this one are read as choice.h says. c->outdone is set where another method keeps
 * the bound for single elements too, so that the cost of c does not count. c->left is the share of S that
 * c leaves out beyond epsilon: `single`, the error that is allowed to single elements, is the largest of
 * epsilon and of `left` of all c that count. out->open says that F is not known yet, and could show that
 * this method suits it best. decision_claimed() is true where a method is taken for another reason than
 * its cost; nothing is estimated then, unless so_far->thorough asks for figures of methods that are not
 * taken.
 *
 * An entry costs as much time as CHOICE_SCATTERED coefficients, and as much memory as two. `most` is the
 * number of entries of a channel up to which this method is the fastest and fits into memory,
 *     most = min(decision_rival / CHOICE_SCATTERED, so_far->most / (2 C)),
 * where decision_rival is the lowest cost of the methods that count, and so_far->most is the number of
 * coefficients that memory holds. */
static lam_status weigh(const decision *so_far, void *own, candidate *out, lam_error *error) {
    lam_status status = LAM_OK;
    sparse_options *o = own;
    const build_problem *p = so_far->problem;
    const double n = (double)p->n, C = (double)p->n_channels, epsilon = so_far->options->epsilon;
    double entries = -1, single = epsilon;
    bool filtered = false;
    out->object = "sparse";
    for (size_t k = 0; k < so_far->n_candidates; k++) {
        const candidate *c = &so_far->candidates[k];
        filtered = filtered || ((c->method->flags & METHOD_FILTERS_NOISE) && (isfinite(c->cost) || c->open));
        if (!c->outdone) single = fmax(single, c->left);
    }
    if (filtered && p->noise > epsilon && o->threshold == 0) return LAM_OK;
    out->open = p->F == NULL;
    if (out->open || so_far->density >= 1 / CHOICE_SCATTERED ||
        (decision_claimed(so_far) && !so_far->thorough))
        return LAM_OK;
    const double most = fmin(decision_rival(so_far) / CHOICE_SCATTERED, so_far->most / 2 / C);
    TRY(find_threshold(so_far, single, most, &o->threshold, &entries, out, error));
    if (entries < 0) goto done;
    if (2 * C * entries <= so_far->most) out->cost = CHOICE_SCATTERED * entries;
    candidate_figure(out, "entries", entries);
    candidate_figure(out, "threshold", o->threshold);
    snprintf(out->found, sizeof out->found, "sparse inverse of %.3g entries, %.3g %%, at threshold %.3g",
             entries, 100 * entries / (n * n), o->threshold);
done:
    return status;
}

const build_method method_sparse = {
    .name = "sparse",
    .summary = "entries above a threshold; cities and mazes, where most of the scene is hidden",
    .kind = &operator_sparse,
    .rows = rows,
    .forecast = forecast,
    .weigh = weigh,
    .build = build,
};
_Static_assert(sizeof(sparse_options) <= METHOD_OPTIONS_BYTES, "they fit");
