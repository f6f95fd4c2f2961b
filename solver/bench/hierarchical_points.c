/* Every kind of operator on one scene: memory, build time and query time against total indirect error. */
#include "solver/bench/bench_hierarchical.h"
#include "solver/bench/formfactors.h"
#include "solver/method/classify.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    PROBES_QUICK = 8,
    PROBES = 64,
    PROBES_OF_LARGE = 24,
    LARGE = 5000,
    PAIRS_MOST = 24000,
    HUGE_SCENE = 60000
};

const char *const hierarchical_kinds[KINDS] = {"hierarchical", "low-rank", "2msc",
                                               "sparse",       "exact",    "emitters"};
const char *const hierarchical_lights[LIGHTS] = {"single", "lights", "all over"};

/* epsilon; for 2msc k over n, of a sparse inverse the threshold */
static const double settings[KINDS][SETTINGS_MOST] = {{.2, .1, .05, .02, .01},
                                                      {.3, .2, .1, .05, .02},
                                                      {1. / 32, 1. / 16, 1. / 8, 1. / 4},
                                                      {3e-3, 1e-3, 3e-4, 1e-4, 3e-5},
                                                      {1},
                                                      {1}};

/* Accuracy of the form factors that judge, far finer than those judged. */
static const double judge_accuracy = 2e-5;

const table_column hierarchical_points_columns[] = {
    {"scene", NULL, "which"},
    {"elements", "", "n"},
    {"channels", "", "C"},
    {"kind", NULL, "of operator"},
    {"setting", "", "epsilon of hierarchical and low-rank, k / n of 2msc, threshold of sparse"},
    {"rank", "", "k"},
    {"build_s", "s", "without form factors"},
    {"query_ms", "ms", "of one radiosity, median, one thread"},
    {"mb", "MB", "that a query reads"},
    {"stored_mb", "MB", "of the operator in a store"},
    {"single", "", "total indirect error, one bright element, mean"},
    {"lights", "", "the scene's lights (of emitters: all of them)"},
    {"all_over", "", "light all over, mean"},
    {"single_relative", "", "total relative error of the same"},
    {"lights_relative", "", "the same"},
    {"all_over_relative", "", "the same"},
};
const size_t hierarchical_points_width =
    sizeof hierarchical_points_columns / sizeof *hierarchical_points_columns;

/* Form factors that judge: pairs, or, of more elements, near pairs and rays of another seed. */
static recipe recipe_of_reference(const bench_run *run, const lowrank_scene *s) {
    if (s->m.n <= PAIRS_MOST && run->scale != BENCH_QUICK)
        return formfactors_pairs(judge_accuracy, run->seed + 1000);
    recipe r = s->f.recipe;
    r.seed = run->seed + 1000;
    return r;
}

static void add_row(const lowrank_scene *s, const char *kind, double setting, const lowrank_verdict *v,
                    table *out) {
    const error_group *const groups[LIGHTS] = {&v->judged.single, &v->judged.lights, &v->judged.random};
    table_text(out, s->name);
    table_number(out, (double)s->m.n);
    table_number(out, (double)s->m.n_channels);
    table_text(out, kind);
    table_number(out, setting < 1 ? setting : NAN);
    table_number(out, v->built.rank > 0 ? (double)v->built.rank : NAN);
    table_number(out, v->built.factorize_seconds + v->built.invert_seconds);
    table_number(out, 1e3 * v->answer_seconds);
    table_number(out, 1e-6 * v->bytes);
    table_number(out, 1e-6 * v->stored);
    for (size_t g = 0; g < LIGHTS; g++)
        table_number(out, groups[g]->probes > 0 ? groups[g]->total_indirect.mean : NAN);
    for (size_t g = 0; g < LIGHTS; g++)
        table_number(out, groups[g]->probes > 0 ? groups[g]->total_relative.mean : NAN);
}

static kind_point point_of(double setting, const lowrank_verdict *v) {
    const error_group *const groups[LIGHTS] = {&v->judged.single, &v->judged.lights, &v->judged.random};
    kind_point p = {.setting = setting,
                    .build_s = v->built.factorize_seconds + v->built.invert_seconds,
                    .query_ms = 1e3 * v->answer_seconds,
                    .mb = 1e-6 * v->bytes,
                    .stored_mb = 1e-6 * v->stored};
    for (size_t g = 0; g < LIGHTS; g++)
        p.error[g] = groups[g]->probes > 0 ? groups[g]->total_indirect.mean : NAN;
    return p;
}

/* The scene's lights as one emitter, or an element that is bright. */
static lam_status emitter_of(const lowrank_scene *s, float **E, lam_error *error) {
    const size_t all = s->m.n * s->m.n_channels;
    bool any = false;
    *E = memory_allocate(all, sizeof **E, "emitters", error);
    if (*E == NULL) return LAM_ERR_MEMORY;
    memcpy(*E, s->m.emission, all * sizeof **E);
    for (size_t i = 0; i < all; i++) any = any || (*E)[i] > 0;
    for (size_t c = 0; c < s->m.n_channels && !any; c++) (*E)[c * s->m.n + s->z_order[s->m.n / 2]] = 1;
    return LAM_OK;
}

/* Whether a setting is worth its time here: rank and whole inverse grow too fast, quick leaves out every
 * second one. */
static bool is_tried(const bench_run *run, const lowrank_scene *s, size_t kind, int setting) {
    const char *name = hierarchical_kinds[kind];
    if (settings[kind][setting] == 0) return false;
    if (strcmp(name, "exact") == 0) return s->m.n <= CLASSIFY_EXACT_MOST;
    if (run->scale == BENCH_QUICK && setting % 2 == 1) return false;
    if (kind > 0 && s->m.n > PAIRS_MOST && setting > 2) return false;
    if (kind > 0 && s->m.n > HUGE_SCENE && setting > 1) return false;
    return true;
}

static lam_status draw(const bench_run *run, const lowrank_scene *s, const kind_curve curves[KINDS],
                       const char *what, const char *label, size_t offset, lam_error *error) {
    double x[KINDS][SETTINGS_MOST], y[KINDS][SETTINGS_MOST];
    plot_series series[KINDS];
    char name[96], title[160];
    size_t drawn = 0;
    for (size_t k = 0; k < KINDS; k++) {
        for (size_t p = 0; p < curves[k].n; p++) {
            x[k][p] = *(const double *)((const char *)&curves[k].at[p] + offset);
            y[k][p] = curves[k].at[p].error[LIGHT_SINGLE];
        }
        if (curves[k].n > 0 && strcmp(hierarchical_kinds[k], "emitters") != 0)
            series[drawn++] = (plot_series){
                .label = hierarchical_kinds[k], .n = curves[k].n, .x = x[k], .y = y[k], .joined = true};
    }
    snprintf(name, sizeof name, "%s-by-%s", s->name, what);
    for (char *c = name; *c != '\0'; c++) *c = *c == ' ' ? '-' : *c;
    snprintf(title, sizeof title, "%s of %zu elements: error by %s", s->name, s->m.n, what);
    const plot p = {.name = name,
                    .title = title,
                    .x_label = label,
                    .y_label = "total indirect error, one bright element",
                    .x_log = true,
                    .y_log = true,
                    .series = series,
                    .n_series = drawn};
    return run->sink->plot(run->sink->context, &p, error);
}

lam_status hierarchical_of_scene(const bench_run *run, const lowrank_scene *s, kind_curve curves[KINDS],
                                 table *out, lam_error *error) {
    lam_status status = LAM_OK;
    form_factors independent = {.row_sums = NULL};
    first_light *first = NULL;
    float *E = NULL;
    double seconds;
    const char *const name = "all lights";
    const recipe other = recipe_of_reference(run, s);
    memset(curves, 0, KINDS * sizeof *curves);
    TRY(emitter_of(s, &E, error));
    const emitter_source lights = {.s = 1, .names = &name, .E = E};
    TRY(formfactors_make_timed(run, &s->m, s->z_order, &other, "independent form factors", &independent,
                               &seconds, error));
    if (independent.F.indptr == NULL) TRY(form_factors_expand(&independent, s->m.area, error));
    if (other.method != RECIPE_PAIRS) TRY(first_light_create(&s->m, run->seed, &first, error));
    for (size_t k = 0; k < KINDS; k++)
        for (int setting = 0; setting < SETTINGS_MOST; setting++) {
            const double value = settings[k][setting];
            const bool two_meshes = strcmp(hierarchical_kinds[k], "2msc") == 0;
            if (!is_tried(run, s, k, setting)) continue;
            const lowrank_case of = {.method = hierarchical_kinds[k],
                                     .factorizer = "auto",
                                     .epsilon = k <= 1 ? value : .05,
                                     .rank = two_meshes ? (size_t)(value * (double)s->m.n) : 0,
                                     .probes = run->scale == BENCH_QUICK ? PROBES_QUICK
                                               : s->m.n > LARGE          ? PROBES_OF_LARGE
                                                                         : PROBES,
                                     .threshold = strcmp(hierarchical_kinds[k], "sparse") == 0 ? value : 0,
                                     .correction = SPARSE_DELTA,
                                     .emitters =
                                         strcmp(hierarchical_kinds[k], "emitters") == 0 ? &lights : NULL,
                                     .independent = &independent.F,
                                     .first = first,
                                     .weighed = true};
            lowrank_verdict v;
            TRY(lowrank_judge(run, s, &of, &v, error));
            add_row(s, hierarchical_kinds[k], value, &v, out);
            curves[k].at[curves[k].n++] = point_of(value, &v);
        }
    TRY(draw(run, s, curves, "memory", "operator in a store, MB", offsetof(kind_point, stored_mb), error));
    TRY(draw(run, s, curves, "build-time", "build, seconds", offsetof(kind_point, build_s), error));
    TRY(draw(run, s, curves, "query-time", "one answer, ms", offsetof(kind_point, query_ms), error));
done:
    free(E);
    first_light_destroy(first);
    form_factors_free(&independent);
    return status;
}
