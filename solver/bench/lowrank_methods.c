/* Every method at several settings: run time and memory against error; two meshes against the SVD at equal k.
 */
#include "solver/bench/formfactors.h"
#include "solver/bench/lowrank.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { PROBES = 100, PROBES_OF_LARGE = 48, LARGE = 5000, KINDS = 7, SETTINGS_MOST = 5 };

/* A method, which is tried at several ranks or bounds. */
typedef struct kind {
    const char *label, *method, *factorizer;
    bool by_rank; /* at ranks, else at bounds */
} kind;

static const kind lowrank_kinds[KINDS] = {
    {"HF", "low-rank", "hf", false},          {"SVD", "low-rank", "svd", true},
    {"RSI", "low-rank", "rsi", true},         {"SGRSVD", "low-rank", "sgrsvd", true},
    {"two meshes", "2msc", "auto", true},     {"two meshes, QR", "2msc", "qr", true},
    {"whole inverse", "exact", "auto", false}};

static const double bounds[SETTINGS_MOST] = {.3, .2, .1, .05, .02};
/* Ranks as shares of n. */
static const double parts[SETTINGS_MOST] = {1. / 32, 1. / 16, 1. / 8, 1. / 5, 1. / 4};

static const table_column columns[] = {
    {"scene", NULL, "name of the scene"},
    {"elements", "", "n"},
    {"method", NULL, "how it was built"},
    {"epsilon", "", "bound asked for"},
    {"rank", "", "k"},
    {"norm", "", "|S - S~|_2"},
    {"build_s", "s", "factorization and inverse, without form factors"},
    {"mb", "MB", "memory that an answer reads"},
    {"answer_ms", "ms", "time of one B, median, one thread"},
    {"single", "", "total indirect error for one bright element, mean"},
    {"lights", "", "likewise for the scene's lights"},
    {"random", "", "likewise for random emission of all elements, mean"},
    {"single_operator", "", "indirect error against the very same form factors"},
    {"lights_operator", "", "against the same form factors"},
    {"random_operator", "", "against the same form factors"},
};

static lam_status try(const bench_run *run, const lowrank_scene *s, const csr *independent, const kind *k,
                      int setting, table *out, lam_error *error) {
    lam_status status = LAM_OK;
    const lowrank_case of = {.method = k->method,
                             .factorizer = k->factorizer,
                             .epsilon = bounds[setting],
                             .rank = k->by_rank ? (size_t)(parts[setting] * (double)s->m.n) : 0,
                             .probes = s->m.n > LARGE ? PROBES_OF_LARGE : PROBES,
                             .independent = independent};
    lowrank_verdict v;
    TRY(lowrank_judge(run, s, &of, &v, error));
    const double mb = 1e-6 * v.bytes;
    const double seconds = report_seconds(&v.built);
    table_text(out, s->name);
    table_number(out, (double)s->m.n);
    table_text(out, k->label);
    table_number(out, k->by_rank || strcmp(k->method, "exact") == 0 ? NAN : of.epsilon);
    table_number(out, report_get(&v.built, "rank", NAN));
    table_number(out, report_get(&v.built, "measured_norm_error", NAN));
    table_number(out, seconds);
    table_number(out, mb);
    table_number(out, 1e3 * v.answer_seconds);
    table_number(out, v.judged.single.total_indirect.mean);
    table_number(out, v.judged.lights.probes > 0 ? v.judged.lights.total_indirect.mean : NAN);
    table_number(out, v.judged.random.total_indirect.mean);
    table_number(out, v.judged.single.operator_indirect.mean);
    table_number(out, v.judged.lights.probes > 0 ? v.judged.lights.operator_indirect.mean : NAN);
    table_number(out, v.judged.random.operator_indirect.mean);
done:
    return status;
}

static lam_status measure(const bench_run *run, const lowrank_scene *s, table *out, lam_error *error) {
    lam_status status = LAM_OK;
    form_factors independent = {.row_sums = NULL}; /* finer, of another seed */
    const recipe finer = formfactors_pairs(2e-5, run->seed + 1000);
    double seconds;
    TRY(formfactors_make_timed(run, &s->m, s->z_order, &finer, "independent form factors", &independent,
                               &seconds, error));
    if (independent.F.indptr == NULL) TRY(form_factors_expand(&independent, s->m.area, error));
    for (int k = 0; k < KINDS; k++)
        for (int setting = 0; setting < SETTINGS_MOST; setting++) {
            if (run->scale == BENCH_QUICK && setting % 2 == 1) continue;
            if (strcmp(lowrank_kinds[k].method, "exact") == 0 && setting > 0) continue;
            TRY(try(run, s, &independent.F, &lowrank_kinds[k], setting, out, error));
        }
done:
    form_factors_free(&independent);
    return status;
}

lam_status lowrank_of_methods(const bench_run *run, lam_error *error) {
    static const size_t sizes[3][2] = {{320, 0}, {2560, 0}, {2560, 10240}};
    lam_status status = LAM_OK;
    lowrank_scene s = {.name = NULL};
    table out = {.name = "methods",
                 .title = "Every method: run time and memory against error",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    for (int k = 0; k < 2 && sizes[run->scale][k] > 0; k++) {
        TRY(lowrank_cornell(run, sizes[run->scale][k], &s, error));
        TRY(measure(run, &s, &out, error));
        lowrank_scene_free(&s);
    }
    TRY(bench_table(run, &out, error));
done:
    lowrank_scene_free(&s);
    table_free(&out);
    return status;
}
