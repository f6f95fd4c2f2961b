/* Form factors beside exact ones: closed forms of single pairs, and enclosures whose factors between whole
 * surfaces are known. */
#include "solver/formfactor/source.h"
#include "solver/method/reference.h"
#include "tests/bench/suites/formfactors.h"
#include "tests/bench/suites/formfactors_truths.h"
#include "tests/bench/suites/stats.h"

#include <math.h>
#include <stdlib.h>

static const table_column case_columns[] = {
    {"case", NULL, "the configuration"},
    {"source", NULL, "source of the truth"},
    {"method", NULL, "how the form factor was computed"},
    {"occluded", "", "1: wholly or partly hidden"},
    {"truth", "", "F"},
    {"estimate", "", "F with the first seed"},
    {"absolute_error", "", "error with the first seed"},
    {"relative_error", "", "error with the first seed"},
    {"stated_bar", "", "error bar: two standard errors, or the tolerance where nothing is sampled"},
    {"repeats", "", "seeds"},
    {"covered", "", "share of the seeds whose error was within the bar stated with it"},
    {"worst_error", "", "largest absolute error of all seeds"},
    {"seconds", "s", "median of all seeds"},
};

static const table_column method_columns[] = {
    {"method", NULL, "how the form factor was computed"},
    {"open_worst", "", "largest relative error of the first seed, nothing between"},
    {"open_median", "", "median of the same"},
    {"hidden_worst", "", "largest relative error of the first seed, something between"},
    {"zero_worst", "", "largest F of all seeds where nothing can pass"},
    {"covered", "", "share of all seeds whose error was within the bar stated with it"},
    {"seconds", "s", "median of a case"},
};

enum { METHODS_MOST = 6, SEEDS_MOST = 21, CASES_MOST = 64 };

/* Figures of one method over all cases. */
typedef struct method_summary {
    double open[CASES_MOST], seconds[CASES_MOST];
    size_t n_open, n_cases, n_runs, n_covered;
    double hidden_worst, zero_worst;
} method_summary;

/* The error bar of an estimate F_ij, from the figures that the method reports and those that a user knows.
 * Rays: two standard errors of independent rays. Of the counts c_ij and c_ji of N rays each,
 *     F = (c_ij + c_ji) / N * A_j / (A_i + A_j)
 * so the variance is [F_ij (1 - F_ij) + F_ji (1 - F_ji)] / N * (A_j / (A_i + A_j))^2; the points of a
 * low-discrepancy sequence do better. Pairs: two of the accuracy reached where something is hidden, else the
 * relative tolerance of the mathematics. A hemicube states nothing. */
static double stated_bar(const recipe *how, const form_factors *f, const mesh *m, const formfactors_truth *t,
                         double F) {
    static const double pairs_tolerance = 1e-6;
    const double a = m->area[t->from], b = m->area[t->to], back = fmin(1, F * a / b);
    if (recipe_source(how) == &source_rays)
        return 2 * sqrt((F * (1 - F) + back * (1 - back)) / (double)how->rays) * b / (a + b);
    if (recipe_source(how) == &source_pairs) return t->occluded ? 2 * f->pairs.accuracy : pairs_tolerance * F;
    return NAN;
}

static lam_status measure_case(const bench_run *run, const formfactors_truth *t, recipe how, size_t seeds,
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
    if (recipe_source(&how) == &source_hemicube) seeds = 1;
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
    else
        sum->open[sum->n_open++] = relative;
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
    recipe_describe(how, method);
    table_text(out, method);
    table_number(out, stats_quantile(sum->open, sum->n_open, 1));
    table_number(out, stats_median(sum->open, sum->n_open));
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
                   .columns = case_columns,
                   .n_columns = sizeof case_columns / sizeof *case_columns};
    table summary = {.name = "closed-forms-summary",
                     .title = "Closed forms: relative error of F by method",
                     .columns = method_columns,
                     .n_columns = sizeof method_columns / sizeof *method_columns,
                     .printed = true};
    method_summary *sums = memory_allocate(n_methods, sizeof *sums, "closed forms", error);
    if (sums == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n_methods; k++) {
        for (size_t c = 0; formfactors_truths[c].name != NULL && c < CASES_MOST; c++)
            TRY(measure_case(run, &formfactors_truths[c], methods[k], seeds, &cases, &sums[k], error));
        summarize(&methods[k], &sums[k], &summary);
    }
    TRY(bench_table(run, &cases, error));
    TRY(bench_table(run, &summary, error));
done:
    table_free(&cases);
    table_free(&summary);
    free(sums);
    return status;
}

static const table_column pair_columns[] = {
    {"enclosure", NULL, "name of the enclosure"},
    {"source", NULL, "source of the truth"},
    {"method", NULL, "how the form factors were computed"},
    {"quantity", NULL, "F, or B in W/m2"},
    {"from", "", "surface, from 1"},
    {"to", "", "surface, from 1"},
    {"truth", "", "F: exact, or as published; B: as published"},
    {"estimate", "", "as computed"},
    {"error", "", "absolute"},
    {"own_accuracy", "", "largest error of the published value"},
};

static const table_column enclosure_columns[] = {
    {"enclosure", NULL, "name of the enclosure"},
    {"method", NULL, "how the form factors were computed"},
    {"F_worst", "", "largest absolute error of a form factor"},
    {"F_own", "", "largest error of the published form factors"},
    {"B_worst", "W/m2", "largest absolute error of a radiosity"},
    {"B_own", "W/m2", "largest error of the published radiosity"},
    {"seconds", "s", "time of the form factors"},
};

enum { SURFACES_MOST = 8 };

/* Area-weighted means of F over the pieces of a surface, and the area that it stands for. */
static void between_surfaces(const formfactors_enclosure *e, const mesh *m, const csr *F, double *out,
                             double *area) {
    for (size_t s = 0; s < e->n_surfaces; s++) {
        double *row = out + s * e->n_surfaces;
        bool first = true;
        area[s] = 0;
        for (size_t t = 0; t < e->n_surfaces; t++) row[t] = 0;
        for (size_t i = 0; i < e->n; i++) {
            if (e->surface[i] != (int)s || (e->strips && !first)) continue;
            first = false;
            area[s] += m->area[i];
            for (size_t j = 0; j < e->n; j++) row[e->surface[j]] += m->area[i] * formfactors_entry(F, i, j);
        }
        for (size_t t = 0; t < e->n_surfaces; t++) row[t] /= area[s];
    }
}

/* B = E + rho F B between the surfaces themselves. */
static lam_status solve_surfaces(const formfactors_enclosure *e, const double *F, const double *area,
                                 double *B, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = e->n_surfaces;
    uint64_t indptr[SURFACES_MOST + 1] = {0};
    uint32_t indices[SURFACES_MOST * SURFACES_MOST];
    float data[SURFACES_MOST * SURFACES_MOST], reflectance[SURFACES_MOST];
    for (size_t i = 0; i < n; i++) {
        reflectance[i] = .1f;
        indptr[i + 1] = (i + 1) * n;
        for (size_t j = 0; j < n; j++) {
            indices[i * n + j] = (uint32_t)j;
            data[i * n + j] = (float)F[i * n + j];
        }
    }
    const csr rows = {.n = n, .indptr = indptr, .indices = indices, .data = data};
    reference *r = NULL;
    TRY(reference_create(&rows, area, reflectance, REFERENCE_DENSE, &r, error));
    TRY(reference_solve(r, 1, e->E, B, 1e-9, NULL, error));
done:
    reference_destroy(r);
    return status;
}

/* One row of the table; returns the error. */
static double add_row(table *out, const formfactors_enclosure *e, const char *method, size_t from, size_t to,
                      const double pair[2], double own) {
    table_text(out, e->name);
    table_text(out, e->source);
    table_text(out, method);
    table_text(out, to > 0 ? "F" : "B");
    table_number(out, (double)from);
    table_number(out, to > 0 ? (double)to : NAN);
    table_number(out, pair[0]);
    table_number(out, pair[1]);
    table_number(out, fabs(pair[1] - pair[0]));
    table_number(out, own);
    return fabs(pair[1] - pair[0]);
}

static lam_status measure_enclosure(const bench_run *run, const formfactors_enclosure *e, const recipe *how,
                                    table *out, table *summary, lam_error *error) {
    lam_status status = LAM_OK;
    mesh m = {0};
    uint32_t *order = NULL;
    form_factors f = {.row_sums = NULL};
    double F[SURFACES_MOST * SURFACES_MOST], area[SURFACES_MOST], B[SURFACES_MOST];
    double seconds, F_worst = 0, B_worst = 0;
    char method[64];
    TRY(scene_of_pieces(e->pieces, e->n, &m, error));
    TRY(formfactors_order(&m, &order, error));
    TRY(formfactors_make_timed(run, &m, order, how, "enclosures", &f, &seconds, error));
    between_surfaces(e, &m, &f.F, F, area);
    recipe_describe(how, method);
    for (size_t s = 0; s < e->n_surfaces; s++)
        for (size_t t = 0; t < e->n_surfaces; t++) {
            const size_t at = s * e->n_surfaces + t;
            const double pair[2] = {e->F[at], F[at]};
            F_worst = fmax(F_worst, add_row(out, e, method, s + 1, t + 1, pair, e->F_within));
        }
    if (e->B != NULL) {
        TRY(solve_surfaces(e, F, area, B, error));
        for (size_t s = 0; s < e->n_surfaces; s++) {
            const double pair[2] = {e->B[s], B[s]};
            B_worst = fmax(B_worst, add_row(out, e, method, s + 1, 0, pair, e->B_within));
        }
    }
    table_text(summary, e->name);
    table_text(summary, method);
    table_number(summary, F_worst);
    table_number(summary, e->F_within);
    table_number(summary, e->B != NULL ? B_worst : NAN);
    table_number(summary, e->B != NULL ? e->B_within : NAN);
    table_number(summary, seconds);
done:
    form_factors_free(&f);
    free(order);
    mesh_free(&m);
    return status;
}

lam_status formfactors_of_enclosures(const bench_run *run, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t rays = run->scale == BENCH_QUICK ? 4096 : 65536,
                 resolution = run->scale == BENCH_QUICK ? 64 : 512;
    const recipe methods[] = {formfactors_rays(rays, run->seed), formfactors_hemicube(resolution),
                              formfactors_pairs(7e-5, run->seed), formfactors_pairs(7e-6, run->seed)};
    const size_t n_methods = run->scale == BENCH_QUICK ? 3 : 4;
    table out = {.name = "enclosures",
                 .title = "Enclosures: every factor between surfaces",
                 .columns = pair_columns,
                 .n_columns = sizeof pair_columns / sizeof *pair_columns};
    table summary = {.name = "enclosures-summary",
                     .title = "Enclosures: largest errors beside the accuracy of what was published",
                     .columns = enclosure_columns,
                     .n_columns = sizeof enclosure_columns / sizeof *enclosure_columns,
                     .printed = true};
    for (const formfactors_enclosure *e = formfactors_enclosures; e->name != NULL; e++)
        for (size_t k = 0; k < n_methods; k++)
            TRY(measure_enclosure(run, e, &methods[k], &out, &summary, error));
    TRY(bench_table(run, &out, error));
    TRY(bench_table(run, &summary, error));
done:
    table_free(&out);
    table_free(&summary);
    return status;
}
