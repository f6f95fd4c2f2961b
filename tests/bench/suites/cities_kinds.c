/* Every kind of operator on the four scenes of figure 5.1: cost, error, and the kind that auto picks. */
#include "solver/method/choice.h"
#include "tests/bench/suites/cities.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { KINDS = 6, EMITTERS_MOST = 32, PROBES = 100, PROBES_OF_LARGE = 32, LARGE = 5000, NAME = 16 };

static const char *const kinds[KINDS] = {"exact", "low-rank", "2msc", "sparse", "hierarchical", "emitters"};

static const double epsilon = .05, usual_threshold = 1e-4;

/* Another kind is compared with the pick if its error is at most this many times that of the pick, or at most
 * epsilon, which is all that was asked for. */
static const double as_exact = 1.5;

typedef struct light_source {
    emitter_source of;
    char names[EMITTERS_MOST][NAME];
    const char *list[EMITTERS_MOST];
    float *E;
} light_source;

static bool shines(const mesh *m, size_t i) {
    bool any = false;
    for (size_t c = 0; c < m->n_channels; c++) any = any || m->emission[c * m->n + i] > 0;
    return any;
}

/* The scene's luminous elements as emitters, several in one where they are more than EMITTERS_MOST; in a
 * scene without lights a sample of its elements. */
static lam_status lights_of(const lowrank_scene *s, light_source *out, lam_error *error) {
    const size_t n = s->m.n, C = s->m.n_channels;
    size_t lit = 0, seen = 0;
    for (size_t i = 0; i < n; i++) lit += shines(&s->m, i);
    const size_t all = lit > 0 ? lit : n, count = all < EMITTERS_MOST ? all : EMITTERS_MOST;
    out->E = memory_allocate(count * C, n * sizeof *out->E, "emitters", error);
    if (out->E == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; lit > 0 && i < n; i++) {
        if (!shines(&s->m, i)) continue;
        const size_t k = seen++ * count / lit;
        for (size_t c = 0; c < C; c++) out->E[(k * C + c) * n + i] = s->m.emission[c * n + i];
    }
    for (size_t k = 0; k < count; k++) {
        snprintf(out->names[k], NAME, "light %zu", k);
        out->list[k] = out->names[k];
        for (size_t c = 0; lit == 0 && c < C; c++) out->E[(k * C + c) * n + s->z_order[k * n / count]] = 1;
    }
    out->of = (emitter_source){.s = count, .names = out->list, .E = out->E};
    return LAM_OK;
}

/* The kind that auto builds, and the threshold that it would choose for a sparse inverse. */
static lam_status find_pick(const bench_run *run, const lowrank_scene *s, size_t *pick, double *threshold,
                            lam_error *error) {
    lam_status status = LAM_OK;
    const build_problem problem = lowrank_problem(s);
    build_options how = build_presets("auto");
    decision looked = {.n_candidates = 0};
    build_report built;
    lam_operator *op = NULL;
    how.seed = run->seed;
    how.progress = run->progress;
    TRY(choose_method(&problem, &how, true, &looked, error));
    TRY(build_operator(&problem, &how, &op, &built, error));
    *threshold = decision_figure(&looked, "sparse", "threshold", usual_threshold);
    for (*pick = 0; *pick + 1 < KINDS && strcmp(kinds[*pick], built.method) != 0;) ++*pick;
    bench_say(run, "%s, %zu elements: auto: %s", s->name, s->m.n, built.reason);
done:
    lam_operator_close(op);
    decision_free(&looked);
    return status;
}

static lam_status judge_kind(const bench_run *run, const lowrank_scene *s, const char *kind, double threshold,
                             const light_source *lights, lowrank_verdict *out, lam_error *error) {
    const bool few = strcmp(kind, "emitters") == 0, sparse = strcmp(kind, "sparse") == 0;
    const lowrank_case of = {.method = kind,
                             .factorizer = "auto",
                             .epsilon = epsilon,
                             .probes = s->m.n > LARGE ? PROBES_OF_LARGE : PROBES,
                             .threshold = sparse ? threshold : 0,
                             .emitters = few ? &lights->of : NULL};
    return lowrank_judge(run, s, &of, out, error);
}

static bool is_as_exact(const error_report *a, const error_report *pick) {
    return a->single.operator_indirect.mean <=
               fmax(epsilon, as_exact * pick->single.operator_indirect.mean) &&
           a->random.operator_indirect.mean <= fmax(epsilon, as_exact * pick->random.operator_indirect.mean);
}

/* Time of the pick over that of the fastest kind that is about as exact. The kind emitters is left out, as it
 * answers for its own lights alone. */
static double over_fastest(const lowrank_verdict verdicts[KINDS], size_t pick) {
    double fastest = verdicts[pick].answer_seconds;
    for (size_t k = 0; k + 1 < KINDS; k++)
        if (is_as_exact(&verdicts[k].judged, &verdicts[pick].judged))
            fastest = fmin(fastest, verdicts[k].answer_seconds);
    return verdicts[pick].answer_seconds / fastest;
}

static void add_row(const lowrank_scene *s, size_t k, double threshold, const lowrank_verdict verdicts[KINDS],
                    size_t pick, table *out) {
    const lowrank_verdict *v = &verdicts[k];
    const error_group *groups[] = {&v->judged.single, &v->judged.lights, &v->judged.random};
    table_text(out, s->name);
    table_number(out, (double)s->m.n);
    table_number(out, (double)s->m.n_channels);
    table_text(out, kinds[k]);
    table_number(out, report_get(&v->built, "rank", NAN));
    table_number(out, report_get(&v->built, "threshold", NAN) > 0 ? threshold : NAN);
    table_number(out, report_seconds(&v->built));
    table_number(out, 1e3 * v->answer_seconds);
    table_number(out, 1e-6 * v->bytes);
    for (size_t g = 0; g < sizeof groups / sizeof *groups; g++) {
        table_number(out, groups[g]->probes > 0 ? groups[g]->operator_relative.mean : NAN);
        table_number(out, groups[g]->probes > 0 ? groups[g]->operator_indirect.mean : NAN);
    }
    table_text(out, k == pick ? "auto" : "");
    table_number(out, k == pick ? over_fastest(verdicts, pick) : NAN);
}

static lam_status add_scene(const bench_run *run, const lowrank_scene *s, table *out, lam_error *error) {
    lam_status status = LAM_OK;
    lowrank_verdict verdicts[KINDS];
    light_source lights = {.E = NULL};
    double threshold;
    size_t pick;
    TRY(lights_of(s, &lights, error));
    TRY(find_pick(run, s, &pick, &threshold, error));
    for (size_t k = 0; k < KINDS; k++)
        TRY(judge_kind(run, s, kinds[k], threshold, &lights, &verdicts[k], error));
    for (size_t k = 0; k < KINDS; k++) add_row(s, k, threshold, verdicts, pick, out);
done:
    free(lights.E);
    return status;
}

lam_status cities_kinds(const bench_run *run, const lowrank_scene *scenes, lam_error *error) {
    static const table_column columns[] = {
        {"scene", NULL, "scene of figure 5.1"},
        {"elements", "", "n"},
        {"channels", "", "C"},
        {"kind", NULL, "kind of operator, at the defaults of precompute and epsilon .05"},
        {"rank", "", "k"},
        {"threshold", "", "threshold of the sparse inverse: that of auto, else 1e-4"},
        {"build_s", "s", "time of the build, without form factors"},
        {"query_ms", "ms", "time of one radiosity, median, one thread"},
        {"mb", "MB", "memory that one radiosity reads"},
        {"single_relative", "", "|B~ - B|/|B|, one bright element (of emitters: one of them), mean"},
        {"single_indirect", "", "|B~ - B|/|B - E| of the same"},
        {"lights_relative", "", "the scene's lights"},
        {"lights_indirect", "", "the same"},
        {"random_relative", "", "random emission of all elements (of emitters: all of them), mean"},
        {"random_indirect", "", "the same"},
        {"picked", NULL, "auto: the kind that --method auto builds"},
        {"over_fastest", "",
         "query of the pick over that of the fastest kind of at most 1.5 times its indirect errors, or .05, "
         "emitters apart"}};
    lam_status status = LAM_OK;
    table out = {.name = "kinds",
                 .title = "Every kind of operator on the scenes of figure 5.1",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    for (size_t k = 0; k < MAP_MAIN; k++) TRY(add_scene(run, &scenes[k], &out, error));
    TRY(bench_table(run, &out, error));
done:
    table_free(&out);
    return status;
}
