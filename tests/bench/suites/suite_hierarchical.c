/* Suite hierarchical: this kind of operator beside all others on every scene. */
#include "solver/formfactor/source.h"
#include "solver/method/choice.h"
#include "tests/bench/suites/cities.h"
#include "tests/bench/suites/formfactors.h"
#include "tests/bench/suites/hierarchical.h"
#include "tests/bench/suites/scenes.h"
#include "tests/bench/suites/stats.h"

#include <libgen.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Elements up to which the whole inverse is built in a bearable time. */
enum { EXACT_MOST = 12288 };

enum {
    PROBES_QUICK = 8,
    PROBES = 64,
    PROBES_OF_LARGE = 24,
    LARGE = 5000,
    PAIRS_MOST = 24000,
    HUGE_SCENE = 60000
};

/* Kinds of operator, the first of them hierarchical, and settings of each, from coarse to fine. */
enum { KINDS = 6, SETTINGS_MOST = 5 };
/* Emissions of the errors: one bright element, the scene's lights, random emission of all elements. */
enum { LIGHT_SINGLE, LIGHT_LAMPS, LIGHT_ALL_OVER, LIGHTS };

/* Cost and errors of one operator. */
typedef struct kind_point {
    double setting, build_s, query_ms, mb, stored_mb;
    double error[LIGHTS]; /* total indirect, mean; NaN: not measured */
} kind_point;
typedef struct kind_curve {
    size_t n;
    kind_point at[SETTINGS_MOST];
} kind_curve;

static const char *const kinds[KINDS] = {"hierarchical", "low-rank", "2msc", "sparse", "exact", "emitters"};
static const char *const light_names[LIGHTS] = {"single", "lights", "random"};

/* epsilon; k/n of 2msc; the threshold of a sparse inverse */
static const double settings[KINDS][SETTINGS_MOST] = {{.2, .1, .05, .02, .01},
                                                      {.3, .2, .1, .05, .02},
                                                      {1. / 32, 1. / 16, 1. / 8, 1. / 4},
                                                      {3e-3, 1e-3, 3e-4, 1e-4, 3e-5},
                                                      {1},
                                                      {1}};

/* Accuracy of the reference form factors, far finer than that of the form factors in use. */
static const double judge_accuracy = 2e-5;

static const table_column points_columns[] = {
    {"scene", NULL, "name of the scene"},
    {"elements", "", "n"},
    {"channels", "", "C"},
    {"kind", NULL, "kind of operator"},
    {"setting", "", "epsilon of hierarchical and low-rank, k / n of 2msc, threshold of sparse"},
    {"rank", "", "k"},
    {"build_s", "s", "time of the build, without form factors"},
    {"query_ms", "ms", "time of one radiosity, median, one thread"},
    {"mb", "MB", "memory that one radiosity reads"},
    {"stored_mb", "MB", "size of the operator in a store"},
    {"single", "", "total indirect error, one bright element, mean"},
    {"lights", "", "the scene's lights (of emitters: all of them)"},
    {"random", "", "likewise for random emission of all elements"},
    {"single_relative", "", "total relative error of the same"},
    {"lights_relative", "", "the same"},
    {"random_relative", "", "the same"},
};

/* Reference form factors: pair by pair, or, in large scenes, by the same recipe with another seed. */
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
    table_number(out, report_get(&v->built, "rank", NAN));
    table_number(out, report_seconds(&v->built));
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
                    .build_s = report_seconds(&v->built),
                    .query_ms = 1e3 * v->answer_seconds,
                    .mb = 1e-6 * v->bytes,
                    .stored_mb = 1e-6 * v->stored};
    for (size_t g = 0; g < LIGHTS; g++)
        p.error[g] = groups[g]->probes > 0 ? groups[g]->total_indirect.mean : NAN;
    return p;
}

/* The scene's lights as one emitter, or one bright element where it has none. */
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

/* Leaves out settings that take too long: fine ones of other kinds in large scenes, and every second one in a
 * quick run. */
static bool is_tried(const bench_run *run, const lowrank_scene *s, size_t kind, int setting) {
    const char *name = kinds[kind];
    if (settings[kind][setting] == 0) return false;
    if (strcmp(name, "exact") == 0) return s->m.n <= EXACT_MOST;
    if (run->scale == BENCH_QUICK && setting % 2 == 1) return false;
    if (kind > 0 && s->m.n > PAIRS_MOST && setting > 2) return false;
    if (kind > 0 && s->m.n > HUGE_SCENE && setting > 1) return false;
    return true;
}

static lam_status measure_scene(const bench_run *run, const lowrank_scene *s, kind_curve curves[KINDS],
                                table *out, hierarchical_plane *plane, lam_error *error) {
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
    if (recipe_source(&other) != &source_pairs) TRY(first_light_create(&s->m, run->seed, &first, error));
    for (size_t k = 0; k < KINDS; k++)
        for (int setting = 0; setting < SETTINGS_MOST; setting++) {
            const double value = settings[k][setting];
            const bool two_meshes = strcmp(kinds[k], "2msc") == 0;
            if (!is_tried(run, s, k, setting)) continue;
            const lowrank_case of = {.method = kinds[k],
                                     .factorizer = "auto",
                                     .epsilon = k <= 1 ? value : .05,
                                     .rank = two_meshes ? (size_t)(value * (double)s->m.n) : 0,
                                     .probes = run->scale == BENCH_QUICK ? PROBES_QUICK
                                               : s->m.n > LARGE          ? PROBES_OF_LARGE
                                                                         : PROBES,
                                     .threshold = strcmp(kinds[k], "sparse") == 0 ? value : 0,
                                     .emitters = strcmp(kinds[k], "emitters") == 0 ? &lights : NULL,
                                     .independent = &independent.F,
                                     .first = first,
                                     .weighed = true};
            lowrank_verdict v;
            TRY(lowrank_judge(run, s, &of, &v, error));
            add_row(s, kinds[k], value, &v, out);
            curves[k].at[curves[k].n++] = point_of(value, &v);
        }
    TRY(hierarchical_plane_add(run, s, &independent.F, first, plane, error));
done:
    free(E);
    first_light_destroy(first);
    form_factors_free(&independent);
    return status;
}

static const table_column equal_columns[] = {
    {"scene", NULL, "name of the scene"},
    {"elements", "", "n"},
    {"light", NULL, "emission"},
    {"epsilon", "", "epsilon of the hierarchical operator"},
    {"error", "", "total indirect error of the hierarchical operator, mean"},
    {"stored_mb", "MB", "its size in a store"},
    {"least_kind", NULL, "the smallest other kind with an error as small; -: none"},
    {"least_mb", "MB", "size of that kind, interpolated by powers between two of its settings"},
    {"stored_share", "", "stored_mb over least_mb"},
    {"mb", "MB", "memory that one radiosity reads"},
    {"mb_share", "", "mb over that of the other kind that reads least"},
    {"query_ms", "ms", "of one radiosity, one thread"},
    {"query_share", "", "query_ms over that of the fastest other kind"},
    {"build_s", "s", "time of the build, without form factors"},
    {"build_share", "", "build_s over that of the other kind that is built fastest"},
};

static double cost_of(const kind_point *p, size_t offset) {
    return *(const double *)((const char *)p + offset);
}

/* The least cost of a kind for an error of at most `error`. */
static double least_cost(const kind_curve *c, size_t light, double error, size_t offset) {
    double errors[SETTINGS_MOST], costs[SETTINGS_MOST];
    for (size_t k = 0; k < c->n; k++) {
        errors[k] = c->at[k].error[light];
        costs[k] = cost_of(&c->at[k], offset);
    }
    return stats_cost_at(c->n, errors, costs, error);
}

/* The least cost of all kinds but hierarchical that answer for any emission. */
static double least_of_others(const kind_curve curves[KINDS], size_t light, double error, size_t offset,
                              const char **kind) {
    double least = INFINITY;
    *kind = "-";
    for (size_t k = 1; k < KINDS; k++) {
        if (strcmp(kinds[k], "emitters") == 0) continue;
        const double cost = least_cost(&curves[k], light, error, offset);
        if (!(cost < least)) continue;
        least = cost;
        *kind = kinds[k];
    }
    return least;
}

static void add_equal(const lowrank_scene *s, const kind_curve curves[KINDS], table *out) {
    static const size_t offsets[] = {offsetof(kind_point, mb), offsetof(kind_point, query_ms),
                                     offsetof(kind_point, build_s)};
    for (size_t light = 0; light < LIGHTS; light++)
        for (size_t k = 0; k < curves[0].n; k++) {
            const kind_point *own = &curves[0].at[k];
            const double error = own->error[light];
            const char *kind, *unused;
            if (!isfinite(error)) continue;
            const double least =
                least_of_others(curves, light, error, offsetof(kind_point, stored_mb), &kind);
            table_text(out, s->name);
            table_number(out, (double)s->m.n);
            table_text(out, light_names[light]);
            table_number(out, own->setting);
            table_number(out, error);
            table_number(out, own->stored_mb);
            table_text(out, kind);
            table_number(out, least);
            table_number(out, isfinite(least) ? own->stored_mb / least : NAN);
            for (size_t o = 0; o < sizeof offsets / sizeof *offsets; o++) {
                const double cost = cost_of(own, offsets[o]);
                const double other = least_of_others(curves, light, error, offsets[o], &unused);
                table_number(out, cost);
                table_number(out, isfinite(other) ? cost / other : NAN);
            }
        }
}

/* Rays in a scene file with too many elements for pairs: about so many of all elements together, and so many
 * of each at least. */
enum { RAYS_OF_FILE = 1 << 27, RAYS_LEAST = 1024 };

/* A quick run takes every third of the first scenes: a city and a Cornell box. */
enum { QUICK_STEP = 3 };

/* Elements of each scene; a scene file is refined to as many. */
static const size_t elements_of[3] = {600, 2500, 8897};

/* Opens the file of --scene; name is its stem. */
static lam_status open_file(const bench_run *run, char name[64], lowrank_scene *out, lam_error *error) {
    lam_status status = LAM_OK;
    mesh m = {0};
    char path[4096];
    const mesh_refinement finer = {.elements = elements_of[run->scale]};
    TRY(scene_file(run->scene, &m, error));
    if (m.n < finer.elements) TRY(mesh_refine(&m, &finer, error));
    snprintf(path, sizeof path, "%s", run->scene);
    snprintf(name, 64, "%s", basename(path));
    char *const dot = strrchr(name, '.');
    if (dot != NULL && dot != name) *dot = '\0';
    recipe how = lowrank_recipe(run, m.n);
    if (recipe_source(&how) != &source_pairs)
        how.rays = m.n < RAYS_OF_FILE / RAYS_LEAST ? RAYS_OF_FILE / m.n : RAYS_LEAST;
    TRY(lowrank_open(run, name, &m, &how, out, error));
done:
    mesh_free(&m);
    return status;
}

lam_status bench_hierarchical(const bench_run *run, lam_error *error) {
    lam_status status = LAM_OK;
    lowrank_scene s = {.name = NULL};
    kind_curve *curves = memory_allocate(KINDS, sizeof *curves, "bench", error);
    char name[64];
    table points = {.name = "hierarchical",
                    .title = "Every kind of operator: cost against total indirect error",
                    .columns = points_columns,
                    .n_columns = sizeof points_columns / sizeof *points_columns,
                    .printed = true};
    table equal = {.name = "equal-error",
                   .title = "At equal total indirect error: hierarchical over the best other kind",
                   .columns = equal_columns,
                   .n_columns = sizeof equal_columns / sizeof *equal_columns,
                   .printed = true};
    hierarchical_plane plane;
    hierarchical_plane_begin(&plane);
    if (curves == NULL) TRY(LAM_ERR_MEMORY);
    const bool quick = run->scale == BENCH_QUICK;
    const size_t n_scenes = run->scene != NULL ? 1 : quick ? MAP_MAIN : MAP_SCENES;
    for (size_t k = 0; k < n_scenes; k += quick ? QUICK_STEP : 1) {
        if (run->scene != NULL)
            TRY(open_file(run, name, &s, error));
        else
            TRY(map_scene_open(run, map_scenes[k], elements_of[run->scale], &s, error));
        TRY(measure_scene(run, &s, curves, &points, &plane, error));
        add_equal(&s, curves, &equal);
        lowrank_scene_free(&s);
    }
    TRY(bench_table(run, &points, error));
    TRY(bench_table(run, &equal, error));
    TRY(hierarchical_plane_end(run, &plane, error));
    if (run->scene == NULL) TRY(hierarchical_smooth(run, error));
    if (run->scene == NULL) TRY(hierarchical_growth(run, error));
done:
    lowrank_scene_free(&s);
    free(curves);
    table_free(&points);
    table_free(&equal);
    hierarchical_plane_free(&plane);
    return status;
}
