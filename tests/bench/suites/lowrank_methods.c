/* Every method at several settings: run time and memory against error; two meshes of real scenes; iterations
 * without an operator. */
#include "tests/bench/suites/formfactors.h"
#include "tests/bench/suites/lowrank.h"
#include "tests/bench/suites/relaxation.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
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

static lam_status add_two_meshes(const bench_run *run, const lowrank_scene *s, size_t rank,
                                 const char *assign, double theirs, table *out, lam_error *error) {
    lam_status status = LAM_OK;
    lowrank_verdict v;
    const lowrank_case of = {.method = "2msc",
                             .factorizer = "auto",
                             .epsilon = .05,
                             .rank = rank,
                             .assign = assign,
                             .probes = s->m.n > LARGE ? PROBES_OF_LARGE : PROBES};
    TRY(lowrank_judge(run, s, &of, &v, error));
    table_text(out, s->name);
    table_number(out, (double)s->m.n);
    table_text(out, assign);
    table_number(out, report_get(&v.built, "rank", NAN));
    table_number(out, report_get(&v.built, "measured_norm_error", NAN));
    table_number(out, report_seconds(&v.built));
    table_number(out, 1e3 * v.answer_seconds);
    table_number(out, 1 / v.answer_seconds);
    table_number(out, v.judged.single.operator_indirect.mean);
    table_number(out, v.judged.random.operator_indirect.mean);
    table_number(out, theirs);
done:
    return status;
}

enum { PATCHES_OF_PATIO = 1364, PAPER_PATIO = 24128 };

/* As many patches as the patio of Fernandez et al. 2011 has: 1,364 of 24,128 elements, where a GPU gave 430
 * answers a second. */
static lam_status try_two_meshes(const bench_run *run, const lowrank_scene *s, bool courtyard, table *out,
                                 lam_error *error) {
    static const char *const assigns[] = {"inclusion", "proximity"};
    lam_status status = LAM_OK;
    const size_t patches = s->m.n * PATCHES_OF_PATIO / PAPER_PATIO;
    const double theirs = courtyard && run->scale == BENCH_FULL ? 430 : NAN;
    for (size_t a = 0; a < sizeof assigns / sizeof *assigns; a++)
        TRY(add_two_meshes(run, s, patches, assigns[a], theirs, out, error));
done:
    return status;
}

/* Real operators in place of table answers' arbitrary numbers. */
lam_status lowrank_of_two_meshes(const bench_run *run, lam_error *error) {
    static const table_column two_mesh_columns[] = {
        {"scene", NULL, "name of the scene"},
        {"elements", "", "n"},
        {"assign", NULL,
         "elements join the patch that they were split into, or the nearest that faces alike"},
        {"patches", "", "k"},
        {"norm", "", "|S - Q V^T|_2"},
        {"build_s", "s", "time of the operator without form factors"},
        {"answer_ms", "ms", "time of one B, median, one thread"},
        {"fps", "1/s", "B a second"},
        {"single_indirect", "", "|B~ - B|/|B - E|, one bright element, mean"},
        {"random_indirect", "", "random emission of all elements"},
        {"paper_gpu_not_run", "1/s", "as published; nothing ran on a GPU"}};
    static const size_t sizes[3][2] = {{640, 640}, {2560, 2700}, {2560, PAPER_PATIO}};
    table out = {.name = "two-meshes",
                 .title = "Two meshes by inclusion and by proximity",
                 .columns = two_mesh_columns,
                 .n_columns = sizeof two_mesh_columns / sizeof *two_mesh_columns,
                 .printed = true};
    const lam_status status = lowrank_box_and_patio(run, sizes[run->scale], try_two_meshes, &out, error);
    table_free(&out);
    return status;
}

/* The lamps of a scene, or a hundredth of its elements, close together, where it has none. */
static lam_status relax(const bench_run *run, const lowrank_scene *s, bool courtyard, table *out,
                        lam_error *error) {
    static const double epsilons[] = {.05, .003};
    enum { LIT = 100 };
    lam_status status = LAM_OK;
    const size_t n = s->m.n;
    bool shines = false;
    (void)courtyard;
    build_problem problem = lowrank_problem(s);
    problem.n_channels = 1;
    float *E = memory_allocate(n, sizeof *E, "emission", error);
    if (E == NULL) return LAM_ERR_MEMORY;
    memcpy(E, s->m.emission, n * sizeof *E);
    for (size_t i = 0; i < n; i++) shines = shines || E[i] > 0;
    for (size_t k = 0; !shines && k <= n / LIT; k++) E[s->z_order[k]] = 1;
    const relaxation_case of = {.scene = s->name, .problem = &problem, .E = E};
    TRY(relaxation_add(run, &of, out, error));
    for (size_t k = 0; k < sizeof epsilons / sizeof *epsilons; k++) {
        TRY(relaxation_add_operator(run, &of, "low-rank", "epsilon", epsilons[k], out, error));
        TRY(relaxation_add_operator(run, &of, "hierarchical", "epsilon", epsilons[k], out, error));
    }
done:
    free(E);
    return status;
}

lam_status lowrank_of_relaxation(const bench_run *run, lam_error *error) {
    static const size_t sizes[3][2] = {{640, 640}, {2560, 2560}, {2560, 2560}};
    table out = relaxation_table();
    const lam_status status = lowrank_box_and_patio(run, sizes[run->scale], relax, &out, error);
    table_free(&out);
    return status;
}
