#include "solver/precompute.h"

#include "solver/build/judge.h"
#include "solver/clock.h"
#include "solver/element_geometry.h"
#include "solver/forecast.h"
#include "solver/narrow.h"
#include "solver/scene/import.h"

#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Above this many elements a probe is dear: fewer are measured at defaults. */
enum { PROBES = 200, PROBES_OF_LARGE = 32, LARGE = 10240 };

/* What the stages hand on. */
typedef struct work {
    const precompute_options *options;
    terminal *t;
    progress progress;
    double memory;    /* bytes */
    scratch *scratch; /* NULL: none */
    mesh m;
    uint32_t *order;
    form_factors f;
    recipe recipe; /* of f */
    bool large;    /* its rows and the judge's lie in the scratch folder */
    size_t sky_tiles;
    size_t probes;
    lam_operator *op;
    build_report built;
    error_report errors;
} work;

static void work_free(work *w) {
    mesh_free(&w->m);
    free(w->order);
    form_factors_free(&w->f);
    scratch_close(w->scratch, false);
    lam_operator_close(w->op);
}

uint64_t precompute_seed(uint64_t seed, uint64_t purpose) {
    uint64_t x = seed + purpose * 0x9E3779B97F4A7C15u;
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
    x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
    return x ^ (x >> 31);
}

static void log_stage(work *w, const char *stage, double started) {
    terminal_log(w->t, "%-14s%8.2f s", stage, clock_seconds() - started);
}

/* --- scene and mesh --------------------------------------------------------------------------------------
 */

static void log_warnings(terminal *t, const char *warnings) {
    while (*warnings != '\0') {
        const size_t length = strcspn(warnings, "\n");
        if (length > 0) terminal_warn(t, "%.*s", (int)length, warnings);
        warnings += length + (warnings[length] == '\n');
    }
}

static lam_status load_scene(work *w, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = w->options;
    const import_options how = {.unit = o->unit, .up = o->up, .reflectance = o->reflectance};
    import_report report = {0};
    TRY(scene_import(o->input, &how, &w->m, &report, error));
    log_warnings(w->t, report.warnings);
    if (report.dropped_faces > 0)
        terminal_log(w->t, "%zu faces of zero area were dropped", report.dropped_faces);
    if (report.clamped > 0)
        terminal_log(w->t, "%zu materials reflected all light or more: set below 1", report.clamped);
done:
    return status;
}

/* About how many elements there will be; never fewer than now. */
static double elements_after(const mesh *m, const precompute_options *o) {
    const mesh_refinement *how = &o->refinement;
    double n = (double)m->n, area = 0;
    if (how->subdivide_levels > 0) n *= pow(4, how->subdivide_levels);
    if (how->max_edge > 0) {
        for (size_t i = 0; i < m->n; i++) area += m->area[i];
        n = fmax(n, area / (how->max_edge * how->max_edge));
    }
    if (o->two_sided) n *= 2;
    return fmax(n, (double)how->elements);
}

/* The recipe of the judge's samples: with --rays given, of as many also where a store's form factors had
 * others. */
static recipe judge_recipe(const work *w, uint64_t seed) {
    const choice_request *asked = &w->options->form_factors;
    const recipe *of = &w->recipe;
    recipe r = recipe_of_judge(of, choice_rays(asked), seed);
    if (w->options->from_store && r.method == RECIPE_RAYS && asked->rays != CHOICE_AUTO)
        r.rays = (size_t)asked->rays;
    return r;
}

/* Columns of the operator where they are known before: the patches of 2msc without its options are. */
static size_t likely_rank(const precompute_options *o, double n) {
    const bool by_size = o->coherence <= 0 && o->min_area <= 0;
    if (o->rank > 0 || strcmp(o->method, "2msc") != 0 || !by_size) return o->rank;
    return (size_t)ceil(n / 16);
}

static forecast forecast_of(const work *w, double n) {
    const precompute_options *o = w->options;
    return (forecast){.n = (size_t)n,
                      .n_channels = w->m.n_channels,
                      .sky_tiles = w->sky_tiles,
                      .recipe = w->recipe,
                      .judge_recipe = judge_recipe(w, 0),
                      .probes = o->probes == PRECOMPUTE_AUTO ? PROBES_OF_LARGE : o->probes,
                      .from_store = o->from_store,
                      .scratch = o->scratch != NULL,
                      .large = w->large,
                      .keep = o->keep_form_factors,
                      .exact = strcmp(o->method, "exact") == 0,
                      .rank = likely_rank(o, n),
                      .precision = o->precision};
}

/* Chooses the recipe for n elements and sees that it fits. */
static lam_status check_memory(work *w, double n, lam_error *error) {
    const precompute_options *o = w->options;
    sky_tiling tiling = {.n_tiles = w->f.sky.tiling.n_tiles};
    if (o->sky != NULL) {
        const lam_status status = sky_tiling_create(o->sky, w->m.up, &tiling, error);
        if (status != LAM_OK) return status;
    }
    w->sky_tiles = tiling.n_tiles;
    sky_tiling_free(&tiling);
    if (n > 4e9)
        return status_fail(error, LAM_ERR_MEMORY, "%s: %.3g elements, must be below 4e9; refine less",
                           o->input, n);
    forecast f;
    /* All pairs where they are affordable, and the disk in place of memory only where there is no other way.
     */
    const int disk_too = o->scratch != NULL, pairs_too = n <= CHOICE_PAIRS_MOST;
    for (int way = 0; way <= 2 * disk_too + 1; way++) {
        const bool all_pairs = way % 2 == 0;
        if (all_pairs && !pairs_too) continue;
        w->large = way >= 2;
        w->recipe = o->from_store ? w->f.recipe : choice_recipe(&o->form_factors, all_pairs);
        f = forecast_of(w, n);
        if (forecast_bytes(&f) <= w->memory) break;
    }
    return forecast_check(&f, w->memory, error);
}

/* Rows go to the scratch folder as they are found, and whole samples where memory is too small for them. */
static lam_status open_scratch(work *w, lam_error *error) {
    if (w->scratch != NULL) return LAM_OK;
    w->t->nothing = w->options->continues;
    return scratch_open(w->options->scratch, &w->scratch, error);
}

/* A store has its rows: it needs the folder for the judge's only, or where memory is too small. */
static lam_status take_scratch(work *w, lam_error *error) {
    const precompute_options *o = w->options;
    if (o->scratch == NULL) return LAM_OK;
    if (w->probes > 0 || !o->from_store || w->large) return open_scratch(w, error);
    terminal_log(w->t, "a store with form factors does not use --scratch");
    return LAM_OK;
}

static const large_place *large_place_of(const work *w) {
    return w->large ? scratch_place(w->scratch) : NULL;
}

static lam_status load_store(work *w, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    double *row_sums = NULL;
    TRY(store_open(w->options->input, &s, error));
    TRY(mesh_load(s, &w->m, &row_sums, error));
    if (store_has(s, "/form_factors")) {
        TRY(recipe_load(s, &recipe_of_form_factors, &w->f.recipe, error));
        TRY(check_memory(w, (double)w->m.n, error));
    }
    if (w->large) TRY(open_scratch(w, error));
    TRY(form_factors_load(s, &w->m, large_place_of(w), &w->f, error));
    TRY(form_factors_expand(&w->f, w->m.area, error));
    if (store_has(s, "/sky")) TRY(sky_bounce_load(s, w->m.n, &w->f.sky, error));
    if (w->options->reflectance >= 0)
        for (size_t i = 0; i < w->m.n * w->m.n_channels; i++)
            w->m.reflectance[i] = (float)w->options->reflectance;
done:
    free(row_sums);
    store_close(s);
    return status;
}

static lam_status prepare_mesh(work *w, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = w->options;
    mesh_refinement refinement = o->refinement;
    /* --elements counts both sides. */
    if (o->two_sided) refinement.elements = (refinement.elements + 1) / 2;
    TRY(check_memory(w, elements_after(&w->m, o), error));
    if (refinement.subdivide_levels > 0 || refinement.max_edge > 0 || refinement.elements > 0)
        TRY(mesh_refine(&w->m, &refinement, error));
    if (o->two_sided) TRY(mesh_make_two_sided(&w->m, error));
    TRY(check_memory(w, (double)w->m.n, error));
    w->order = memory_allocate(w->m.n, sizeof *w->order, "the order of the elements", error);
    if (w->order == NULL) TRY(LAM_ERR_MEMORY);
    TRY(mesh_z_order(&w->m, w->order, error));
    w->probes = o->probes != PRECOMPUTE_AUTO ? o->probes : w->m.n > LARGE ? PROBES_OF_LARGE : PROBES;
    if (w->probes > w->m.n) w->probes = w->m.n;
    terminal_log(w->t, "%zu elements in %zu groups, %zu channel%s%s", w->m.n, w->m.n_groups, w->m.n_channels,
                 w->m.n_channels == 1 ? "" : "s", w->m.two_sided ? ", two-sided" : "");
done:
    return status;
}

/* --- form factors ----------------------------------------------------------------------------------------
 */

static void log_form_factors(work *w) {
    const form_factors *f = &w->f;
    char how[64];
    recipe_describe(&f->recipe, how);
    terminal_log(w->t,
                 "%s: %.2f %% leave the scene%s, %.2f %% meet back faces; row sums repaired by "
                 "%.2g on average, at most %.2g",
                 how, 100 * f->leaving_share, f->closed ? " (closed)" : "", 100 * f->absorbed_share,
                 f->repair_mean, f->repair_max);
    if (f->pairs.accuracy > f->recipe.accuracy)
        terminal_log(w->t,
                     "so much is partly hidden that it was found to a standard error of %.2g, not %.2g; "
                     "--quality high looks closer",
                     f->pairs.accuracy, f->recipe.accuracy);
    if (f->pairs.facing > 0) {
        const double all = .5 * (double)w->m.n * (double)(w->m.n - 1), facing = f->pairs.facing;
        terminal_log(w->t,
                     "%.1f %% of all pairs taken one by one; of those %.1f %% have nothing between them, "
                     "%.1f %% are plainly open, %.1f %% plainly hidden",
                     100 * facing / all, 100 * f->pairs.certain / facing, 100 * f->pairs.open / facing,
                     100 * f->pairs.hidden / facing);
    }
    const sky_bounce *sky = &f->sky;
    if (sky->first_bounce != NULL)
        terminal_log(w->t, "sky: %s, %zu tiles, ground albedo %g", sky->tiling.name, sky->tiling.n_tiles,
                     sky->ground_albedo);
    if (sky->first_bounce != NULL && f->closed)
        terminal_warn(w->t, "the scene is closed: no element sees the sky");
    if (f->absorbed_share > .01 && !w->m.two_sided)
        terminal_warn(w->t,
                      "%.1f %% of the light meets back faces and is lost there: turn the faces, or give "
                      "--two-sided",
                      100 * f->absorbed_share);
}

/* One line of what is to come, and whether the disks can hold it. */
static lam_status announce(work *w, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = w->options;
    const forecast f = forecast_of(w, (double)w->m.n);
    char memory[32], stored[32], seconds[32], judging[32], scratch_room[32];
    char made[64] = "", judged[64] = "", kept[64] = "";
    double rate;
    TRY(forecast_check_disk(&f, o->output, w->scratch, o->scratch, error));
    if (w->t->quiet || (o->from_store && w->probes == 0)) goto done;
    TRY(form_factors_ray_rate(&w->m, w->order, &rate, error));
    const forecast_times times = forecast_seconds(&f, rate, omp_get_max_threads());
    forecast_format_bytes(forecast_bytes(&f), memory);
    forecast_format_bytes(forecast_store_bytes(&f), stored);
    forecast_format_bytes(forecast_scratch_bytes(&f), scratch_room);
    forecast_format_seconds(times.form_factors, seconds);
    forecast_format_seconds(times.judge, judging);
    /* How much is partly hidden is not known before. */
    const bool pairs = w->recipe.method == RECIPE_PAIRS || w->recipe.method == RECIPE_NEAR_PAIRS;
    if (!o->from_store) snprintf(made, sizeof made, " form factors %s%s,", seconds, pairs ? " or more" : "");
    if (w->probes > 0) snprintf(judged, sizeof judged, " the judge's %s,", judging);
    if (w->scratch != NULL) snprintf(kept, sizeof kept, ", scratch up to %s", scratch_room);
    terminal_log(w->t, "forecast:%s%s at %.3g Mray/s of a trial; memory up to %s, store up to %s%s", made,
                 judged, rate * 1e-6, memory, stored, kept);
    if (w->large) terminal_log(w->t, "rows are kept in %s, as memory is too small for them", o->scratch);
done:
    return status;
}

static void log_kept(work *w, const form_factors *f) {
    if (f->rows_kept > 0)
        terminal_log(w->t, "%zu of %zu rows were in %s already", f->rows_kept, w->m.n, w->options->scratch);
}

static lam_status trace(work *w, lam_error *error) {
    lam_status status = LAM_OK;
    const form_factor_options how = {.recipe = w->recipe,
                                     .progress = &w->progress,
                                     .stage = "form factors",
                                     .scratch = w->scratch,
                                     .scratch_name = "form-factors.rows",
                                     .large = large_place_of(w),
                                     .sky = w->options->sky,
                                     .ground_albedo = w->options->ground_albedo};
    TRY(form_factors_make(&w->m, w->order, &how, &w->f, error));
    log_kept(w, &w->f);
done:
    return status;
}

/* --- operator --------------------------------------------------------------------------------------------
 */

static build_problem problem_of(const work *w) {
    return (build_problem){.n = w->m.n,
                           .n_channels = w->m.n_channels,
                           .area = w->m.area,
                           .reflectance = w->m.reflectance,
                           .F = &w->f.F,
                           .order = w->order,
                           .noise = recipe_noise(&w->f.recipe)};
}

static const char *const corrections[] = {
    [SPARSE_NONE] = "none", [SPARSE_DELTA] = "delta", [SPARSE_DISCARDED] = "discarded"};

static sparse_correction correction_of(const char *name) {
    for (sparse_correction c = SPARSE_NONE; c <= SPARSE_DISCARDED; c++)
        if (strcmp(corrections[c], name) == 0) return c;
    return SPARSE_NONE;
}

static lam_status build(work *w, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = w->options;
    build_problem problem = problem_of(w);
    element_geometry geometry = {0};
    budget_rule rule = BUDGET_SQUARES;
    if (!budget_rule_find(o->budget, &rule))
        FAIL(error, LAM_ERR_ARGUMENT, "--budget %.40s: unknown; use squares, sums or frobenius", o->budget);
    const double held = (w->f.F.place != NULL ? 0 : (double)w->f.F.indptr[w->m.n] * 8) + 400 * (double)w->m.n;
    const build_options how = {.method = o->method,
                               .factorizer = o->factorizer,
                               .epsilon = o->epsilon,
                               .budget = {.rule = rule, .alpha = o->alpha},
                               .levels = o->levels == PRECOMPUTE_AUTO ? -1 : (int)o->levels,
                               .rank = o->rank,
                               .coherence = o->coherence,
                               .min_area = o->min_area,
                               .proximity = o->proximity,
                               .threshold = o->threshold,
                               .correction = correction_of(o->correction),
                               .memory = (size_t)fmax(1, w->memory - held),
                               .seed = o->seed,
                               .progress = &w->progress};
    if (strcmp(o->method, "2msc") == 0) TRY(element_geometry_add(&w->m, &geometry, &problem, error));
    TRY(build_operator(&problem, &how, &w->op, &w->built, error));
    const double noise = recipe_noise(&w->f.recipe);
    const bool patches = w->built.coherence >= 0;
    const bool tried = !patches && (w->built.factorizer != NULL || w->built.factorize_seconds > 0);
    if (w->built.factorizer != NULL || patches) {
        terminal_log(w->t, "%-14s%8.2f s", "factorize", w->built.factorize_seconds);
        terminal_log(w->t, "rank %zu of %zu, real norm error %.3g in the %s", w->built.rank, w->m.n,
                     w->built.measured_norm_error,
                     w->built.norm == TRUNCATION_FROBENIUS ? "Frobenius norm" : "2-norm");
    }
    if (tried && o->rank == 0 && o->epsilon < noise)
        terminal_warn(
            w->t,
            "--epsilon %g is below the sampling noise %.2g of %zu rays: what is stored beyond it is "
            "noise; --rays %zu would fit",
            o->epsilon, noise, w->f.recipe.rays, recipe_auto_rays(o->epsilon, 1. / 4));
    terminal_log(w->t, "%-14s%8.2f s", "invert", w->built.invert_seconds);
    terminal_log(w->t, "%s", w->built.reason);
    lam_operator_set_threads(w->op, (size_t)omp_get_max_threads());
    TRY(narrow_replace(&w->op, o->precision, w->m.area, precompute_seed(o->form_factors.seed, 4), w->t,
                       error));
done:
    element_geometry_free(&geometry);
    return status;
}

/* --- errors ----------------------------------------------------------------------------------------------
 */

static void log_figures(terminal *t, const char *name, const error_group *g, bool has_total) {
    if (g->probes == 0) return;
    if (has_total)
        terminal_log(t, "%-8s total relative %.3g, indirect %.3g (noise of the reference %.2g)", name,
                     g->total_relative.mean, g->total_indirect.mean, g->reference_noise);
    terminal_log(t, "%-8s operator relative %.3g, indirect %.3g", name, g->operator_relative.mean,
                 g->operator_indirect.mean);
}

/* Two more samples of F, their mean, and what they say of the operator. */
static lam_status judge(work *w, lam_error *error) {
    lam_status status = LAM_OK;
    static const char *const stages[2] = {"form factors for the judge, 1 of 2",
                                          "form factors for the judge, 2 of 2"};
    static const char *const files[2] = {"judge-1.rows", "judge-2.rows"};
    form_factors half[2] = {{.row_sums = NULL}, {.row_sums = NULL}}, mean = {.row_sums = NULL};
    const build_problem problem = problem_of(w);
    uint64_t purpose = 0, seed;
    for (int h = 0; h < 2; h++) {
        /* Independent of what was factorized: kept form factors may have any seed. */
        do seed = precompute_seed(w->options->form_factors.seed, ++purpose);
        while (seed == w->f.recipe.seed);
        const form_factor_options how = {.recipe = judge_recipe(w, seed),
                                         .progress = &w->progress,
                                         .stage = stages[h],
                                         .scratch = w->scratch,
                                         .scratch_name = files[h],
                                         .large = large_place_of(w)};
        TRY(form_factors_make(&w->m, w->order, &how, &half[h], error));
        log_kept(w, &half[h]);
    }
    TRY(form_factors_mean(&half[0], &half[1], &mean, error));
    const judge_input input = {.problem = &problem,
                               .row_sums = w->f.row_sums,
                               .emission = w->m.emission,
                               .independent = &mean.F,
                               .halves = {&half[0].F, &half[1].F},
                               .probes = w->probes,
                               .seed = precompute_seed(w->options->form_factors.seed, 3),
                               .progress = &w->progress};
    TRY(judge_operator(w->op, &input, &w->errors, error));
    log_figures(w->t, "single", &w->errors.single, w->errors.has_total);
    log_figures(w->t, "lights", &w->errors.lights, w->errors.has_total);
    log_figures(w->t, "random", &w->errors.random, w->errors.has_total);
    if (w->options->precision == PANEL_F32)
        TRY(narrow_advise(w->op, &w->errors, w->m.area, precompute_seed(w->options->form_factors.seed, 4),
                          w->t, error));
done:
    form_factors_free(&half[0]);
    form_factors_free(&half[1]);
    form_factors_free(&mean);
    return status;
}

/* --- store -----------------------------------------------------------------------------------------------
 */

static lam_status describe_operator(const work *w, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const build_report *r = &w->built;
    const bool factorized = r->factorizer != NULL;
    operator_description about = {.density = -1};
    operator_describe(w->op, &about);
    TRY(store_set_text(s, "/operator", "method", r->method, error));
    TRY(store_set_text(s, "/operator", "factorizer", factorized ? r->factorizer : "none", error));
    TRY(store_set_text(s, "/operator", "reason", r->reason, error));
    if (r->epsilon >= 0) TRY(store_set_number(s, "/operator", "epsilon", r->epsilon, error));
    TRY(store_set_number(s, "/operator", "rcond", r->rcond, error));
    if (factorized && r->levels > 0 && w->options->rank == 0) {
        TRY(store_set_text(s, "/operator", "budget", w->options->budget, error));
        TRY(store_set_number(s, "/operator", "alpha", w->options->alpha, error));
    }
    if (factorized && r->levels >= 0) {
        TRY(store_set_integer(s, "/operator", "levels", r->levels, error));
        TRY(store_set_number(s, "/operator", "passes", r->factorized.passes, error));
    }
    if (r->threshold > 0) {
        TRY(store_set_number(s, "/operator", "threshold", r->threshold, error));
        TRY(store_set_text(s, "/operator", "correction", corrections[r->correction], error));
    }
    if (r->coherence >= 0) {
        TRY(store_set_text(s, "/operator", "assign", w->options->proximity ? "proximity" : "inclusion",
                           error));
        TRY(store_set_number(s, "/operator", "coherence_min", r->coherence, error));
        TRY(store_set_number(s, "/operator", "patch_area_min", r->patch_area, error));
    }
    if (factorized || r->coherence >= 0) {
        TRY(store_set_integer(s, "/operator", "rank", (int64_t)r->rank, error));
        TRY(store_set_number(s, "/operator", "measured_norm_error", r->measured_norm_error, error));
        TRY(store_set_text(s, "/operator", "norm", r->norm == TRUNCATION_FROBENIUS ? "frobenius" : "2",
                           error));
    } else if (about.density >= 0) {
        TRY(store_set_number(s, "/operator", "density", about.density, error));
    }
    /* What the form factors were made with, so that they can be made again where they are not kept. */
    TRY(recipe_save(&w->f.recipe, &recipe_of_operator, s, error));
done:
    return status;
}

static lam_status save(work *w, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = w->options;
    store *s = NULL;
    TRY(store_create(o->output, &s, error));
    TRY(store_set_text(s, "/", "name", w->m.name, error));
    TRY(store_set_text(s, "/", "tool", "lambert " LAMBERT_VERSION, error));
    TRY(store_set_text(s, "/", "command", o->command, error));
    TRY(store_set_integer(s, "/", "seed", (int64_t)o->form_factors.seed, error));
    TRY(store_set_number(s, "/", "unit", w->m.unit, error));
    TRY(mesh_save(&w->m, w->f.row_sums, s, error));
    if (o->reflectance >= 0) TRY(store_set_number(s, "/mesh", "reflectance_given", o->reflectance, error));
    TRY(terminal_check(error));
    if (o->keep_form_factors && w->m.n > FORM_FACTORS_ROWS_MOST)
        TRY(form_factors_gather(&w->f, w->m.area, error));
    if (o->keep_form_factors) TRY(form_factors_save(&w->f, s, error));
    if (w->f.sky.first_bounce != NULL) TRY(sky_bounce_save(&w->f.sky, s, error));
    TRY(terminal_check(error));
    TRY(operator_save(w->op, s, error));
    TRY(describe_operator(w, s, error));
    if (w->probes > 0) TRY(judge_save(&w->errors, s, error));
    TRY(terminal_check(error));
    store *sealing = s;
    s = NULL;
    TRY(store_seal(sealing, error));
done:
    store_close(s);
    return status;
}

lam_status precompute_run(const precompute_options *options, terminal *t, build_report *report,
                          lam_error *error) {
    lam_status status = LAM_OK;
    work w = {.options = options, .t = t, .progress = terminal_progress(t)};
    const uint64_t available = memory_available();
    w.memory = options->memory > 0 ? (double)options->memory
               : available > 0     ? .7 * (double)available
                                   : 0x1p60;

    double started = clock_seconds();
    TRY(options->from_store ? load_store(&w, error) : load_scene(&w, error));
    log_stage(&w, "import", started);
    TRY(terminal_check(error));

    started = clock_seconds();
    TRY(prepare_mesh(&w, error));
    log_stage(&w, "mesh", started);
    TRY(terminal_check(error));

    TRY(take_scratch(&w, error));
    TRY(announce(&w, error));
    if (!options->from_store) {
        started = clock_seconds();
        TRY(trace(&w, error));
        log_stage(&w, "form factors", started);
    }
    log_form_factors(&w);

    TRY(build(&w, error));
    TRY(terminal_check(error));

    if (w.probes > 0) {
        started = clock_seconds();
        TRY(judge(&w, error));
        log_stage(&w, "judge", started);
    }
    TRY(terminal_check(error));

    started = clock_seconds();
    TRY(save(&w, error));
    log_stage(&w, "store", started);
    scratch_close(w.scratch, true);
    w.scratch = NULL;
    *report = w.built;
done:
    work_free(&w);
    return status;
}
