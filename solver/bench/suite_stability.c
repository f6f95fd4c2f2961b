/* lambert bench stability: what becomes of operators where numbers are hard. */
#include "solver/bench/bench.h"
#include "solver/bench/stability.h"

#include <stdio.h>

static const table_column columns[] = {
    {"problem", NULL, "which"},
    {"rho", "", "largest reflectance"},
    {"method", NULL, "and factorizer"},
    {"epsilon", "", "asked for"},
    {"rank_asked", "", "0: by epsilon"},
    {"rank", "", "k"},
    {"norm", "", "|S - Q V^T|_2"},
    {"rcond", "", "of the matrix inverted"},
    {"relative", "", "largest |B~ - B|/|B| over the probes"},
    {"bound", "", "norm / (1 - max rho)"},
    {"indirect", "", "largest |B~ - B|/|B - E|"},
    {"negative", "", "most negative radiosity over the largest"},
    {"energy", "", "what is not kept of the power, closed scenes"},
    {"linearity", "", "relative"},
    {"reciprocity", "", "relative"},
    {"outcome", NULL, "done, or why it was refused"},
};

static lam_status add(const bench_run *run, const stability_problem *p, double rho, const stability_way *way,
                      table *out, lam_error *error) {
    lam_status status = LAM_OK;
    stability_result r;
    char method[64];
    TRY(bench_check(run, error));
    TRY(stability_try(p, way, &r, error));
    snprintf(method, sizeof method, "%s %s", way->method, way->factorizer);
    table_text(out, p->name);
    table_number(out, rho);
    table_text(out, method);
    table_number(out, way->epsilon);
    table_number(out, (double)way->rank);
    table_number(out, (double)r.rank);
    table_number(out, r.norm);
    table_number(out, r.rcond);
    table_number(out, r.relative);
    table_number(out, r.bound);
    table_number(out, r.indirect);
    table_number(out, r.negative);
    table_number(out, r.energy);
    table_number(out, r.linearity);
    table_number(out, r.reciprocity);
    table_text(out, r.status != LAM_OK ? r.message : r.finite ? "done" : "NOT FINITE");
done:
    return status;
}

lam_status bench_stability(const bench_run *run, lam_error *error) {
    static const double rhos[] = {.5, .9, .99, .999, .9999};
    static const stability_way ways[] = {
        {"exact", "auto", .05, 0},       {"low-rank", "hf", .05, 0},   {"low-rank", "hf", .001, 0},
        {"low-rank", "svd", .05, 0},     {"low-rank", "rsi", .05, 0},  {"low-rank", "sgrsvd", .05, 0},
        {"low-rank", "hf", .05, 1},      {"low-rank", "svd", .05, 1},  {"low-rank", "rsi", .05, 1},
        {"low-rank", "sgrsvd", .05, 1},  {"low-rank", "hf", .05, 999}, {"low-rank", "rsi", .05, 999},
        {"low-rank", "sgrsvd", .05, 999}};
    lam_status status = LAM_OK;
    stability_problem p = {0};
    table out = {.name = "operators",
                 .title = "Operators of problems that are hard on numbers",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    for (int which = 0; which < STABILITY_PROBLEMS; which++)
        for (size_t k = 0; k < sizeof rhos / sizeof *rhos; k++) {
            if (run->scale == BENCH_QUICK && k % 2 == 1) continue;
            TRY(stability_make(which, rhos[k], &p, error));
            for (size_t w = 0; w < sizeof ways / sizeof *ways; w++)
                TRY(add(run, &p, which == STABILITY_BLACK ? 0 : rhos[k], &ways[w], &out, error));
            stability_free(&p);
            if (which == STABILITY_BLACK) break;
        }
    TRY(bench_table(run, &out, error));
done:
    stability_free(&p);
    table_free(&out);
    return status;
}
