/* The operator of a precompute and its measured errors. */
#include "solver/base/random.h"
#include "solver/precompute/judging.h"
#include "solver/precompute/plan.h"
#include "solver/precompute/stages.h"
#include "solver/scene/glass.h"
#include "solver/scene/surfaces.h"

#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static lam_status find_geometry(precompute_scene *scene, unsigned needs, lam_error *error) {
    const mesh *m = &scene->m;
    size_t n_surfaces;
    if (scene->centre == NULL) {
        scene->centre = memory_allocate(m->n, sizeof *scene->centre, "centroids", error);
        if (scene->centre == NULL) return LAM_ERR_MEMORY;
        for (size_t i = 0; i < m->n; i++) mesh_centroid(m, i, scene->centre[i]);
    }
    if (!(needs & METHOD_SURFACES) || scene->surface != NULL) return LAM_OK;
    scene->surface = memory_allocate(m->n, sizeof *scene->surface, "surfaces", error);
    return scene->surface == NULL ? LAM_ERR_MEMORY : mesh_surfaces(m, scene->surface, &n_surfaces, error);
}

lam_status problem_of(precompute_scene *scene, precompute_factors *factors, unsigned needs,
                      build_problem *problem, lam_error *error) {
    lam_status status = LAM_OK;
    const form_factors *f = &factors->f;
    scene->emitting = (emitter_source){.s = scene->emitters.s,
                                       .names = (const char *const *)scene->emitters.names,
                                       .E = scene->emitters.light.E,
                                       .n_tiles = f->sky.tiling.n_tiles,
                                       .L = scene->emitters.light.L,
                                       .first_bounce = f->sky.first_bounce,
                                       .n_luminaires = scene->emitters.n_luminaires,
                                       .luminaires = scene->emitters.luminaires,
                                       .H = scene->luminaires.H,
                                       .factors = scene->emitters.factors};
    *problem = (build_problem){.emitters = emitter_list_count(&scene->emitters) > 0 ? &scene->emitting : NULL,
                               .n = scene->m.n,
                               .n_channels = scene->m.n_channels,
                               .area = scene->m.area,
                               .reflectance = scene->m.reflectance,
                               .F = factors->rays != NULL || factors->blocks.n > 0 ? NULL : &f->F,
                               .blocks = factors->blocks.n > 0 ? &factors->blocks : NULL,
                               .stream = factors->rays != NULL ? &factors->stream : NULL,
                               .order = scene->order,
                               .group = scene->m.group,
                               .n_groups = scene->m.n_groups,
                               .importance = scene->importance.n > 0 ? &scene->importance : NULL,
                               .noise = recipe_noise(&f->recipe)};
    if (!(needs & METHOD_GEOMETRY)) goto done;
    TRY(find_geometry(scene, needs, error));
    problem->centre = (const double(*)[3])scene->centre;
    problem->normal = (const float(*)[3])scene->m.normal;
    problem->surface = scene->surface;
    scene->corners =
        (element_corners){(const double(*)[3])scene->m.vertices, (const uint32_t(*)[4])scene->m.elements};
    problem->corners = &scene->corners;
done:
    return status;
}

build_options build_options_of(const precompute_job *job, const precompute_scene *scene,
                               const precompute_factors *factors, const trial_course *course) {
    const csr *F = &factors->f.F;
    const double rows = F->place != NULL || F->indptr == NULL ? 0 : (double)F->indptr[scene->m.n] * 8;
    build_options how = job->options->build;
    lam_error none;
    how.memory = (size_t)fmax(1, job->memory - rows - 400 * (double)scene->m.n);
    how.seed = job->options->seed;
    how.progress = &job->progress;
    if (course->epsilon != how.epsilon) /* of a trial: below one that is in its limits */
        (void)build_set_number(&how, "epsilon", course->epsilon, &none);
    return how;
}

/* The loss for one bright element, and for emissions that are random everywhere. */
typedef struct precision_loss {
    double single, random;
} precision_loss;

/* Probes of each sort. */
enum { PROBES = 8 };

static lam_status apply(const lam_operator *op, const float *E, float *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t bytes = lam_operator_work_bytes(op, 2 * PROBES);
    void *work = memory_allocate(bytes, 1, "the work area of a solve", error);
    if (work == NULL) return LAM_ERR_MEMORY;
    TRY(lam_operator_apply(op, 2 * PROBES, LAM_INDIRECT, E, out, work, bytes, error));
done:
    free(work);
    return status;
}

/* |b - a|/|a| of one vector; 0 where nothing bounces. */
static double difference(const lam_operator *op, const double *area, const float *a, const float *b) {
    const size_t n = lam_operator_elements(op), count = n * lam_operator_channels(op);
    double whole = 0, off = 0;
    for (size_t i = 0; i < count; i++) {
        const double x = (double)a[i], d = (double)b[i] - x;
        whole += area[i % n] * x * x;
        off += area[i % n] * d * d;
    }
    return whole > 0 ? sqrt(off / whole) : 0;
}

static lam_status measure_loss(const lam_operator *op, const lam_operator *narrow, const double *area,
                               uint64_t seed, precision_loss *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = lam_operator_elements(op), n_channels = lam_operator_channels(op),
                 vector = n * n_channels;
    float *E = memory_allocate(2 * PROBES, vector * sizeof *E, "probes", error);
    float *before = memory_allocate(2 * PROBES, vector * sizeof *before, "probes", error);
    float *after = memory_allocate(2 * PROBES, vector * sizeof *after, "probes", error);
    if (E == NULL || before == NULL || after == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t v = 0; v < PROBES; v++) {
        const size_t bright = (size_t)(random_unit(&seed) * (double)n);
        for (size_t c = 0; c < n_channels; c++) E[v * vector + c * n + bright] = 1;
        for (size_t i = 0; i < vector; i++) E[(PROBES + v) * vector + i] = (float)random_unit(&seed);
    }
    TRY(apply(op, E, before, error));
    TRY(apply(narrow, E, after, error));
    *out = (precision_loss){0};
    for (size_t v = 0; v < PROBES; v++) {
        out->single += difference(op, area, before + v * vector, after + v * vector) / PROBES;
        out->random +=
            difference(op, area, before + (PROBES + v) * vector, after + (PROBES + v) * vector) / PROBES;
    }
done:
    free(E);
    free(before);
    free(after);
    return status;
}

/* Replaces *op, in f32, by one of another precision, and logs the error that this adds: |P' - P|/|P| of the
 * reflected light P, area-weighted, channels stacked, for some single elements and for some emissions that
 * are random everywhere. A kind that has no choice stays as it is. */
static lam_status precision_replace(lam_operator **op, panel_precision precision, const double *area,
                                    uint64_t seed, terminal *t, lam_error *error) {
    lam_status status = LAM_OK;
    lam_operator *made = NULL;
    precision_loss loss;
    if ((*op)->kind->narrow == NULL || precision == PANEL_F32) return LAM_OK;
    const size_t before = lam_operator_bytes(*op);
    TRY(operator_narrow(*op, precision, &made, error));
    TRY(measure_loss(*op, made, area, seed, &loss, error));
    lam_operator_close(*op);
    *op = made;
    made = NULL;
    terminal_log(
        t,
        "%s takes %.0f %% of the memory of f32 and adds %.2g to the indirect error of single elements, "
        "%.2g of random emissions",
        panel_precision_name(precision),
        100 * (double)lam_operator_bytes(*op) / (double)(before > 0 ? before : 1), loss.single, loss.random);
done:
    lam_operator_close(made);
    return status;
}

/* auto may take a method that needs geometry and surfaces. */
static unsigned needs_of(const char *method) {
    const build_method *m = method_find(method);
    return m == NULL ? METHOD_GEOMETRY | METHOD_SURFACES : m->flags;
}

static void log_report(const precompute_job *job, const precompute_factors *factors,
                       const made_operator *made) {
    const build_report *r = &made->built;
    const precompute_options *o = job->options;
    char line[512];
    for (size_t k = 0; k < r->n_steps; k++) terminal_log_stage(job->t, r->steps[k].name, r->steps[k].seconds);
    report_line(r, line, sizeof line);
    terminal_log(job->t, "%s", line);
    if (r->below_noise)
        terminal_warn(
            job->t,
            "--epsilon %g is below the sampling noise %.2g of %zu rays: the part of the operator below it is "
            "noise; --rays %zu would fit",
            o->build.epsilon, recipe_noise(&factors->f.recipe), factors->f.recipe.rays,
            recipe_auto_rays(o->build.epsilon, 1. / 4));
    if (r->doubtful > 0)
        terminal_warn(
            job->t,
            "the operator leaves %.2g of smooth light unexplained, above the %.2g that --epsilon %g "
            "allows: its answers to light of large areas are off by about as much; take another "
            "--method or --form-factors",
            report_get(r, "smooth_residual", 0), r->doubtful, o->build.epsilon);
    terminal_log(job->t, "%s", r->reason);
}

lam_status stage_operator(const precompute_job *job, precompute_scene *scene, const precompute_plan *plan,
                          precompute_factors *factors, made_operator *made, const trial_course *course,
                          lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = job->options;
    const build_options how = build_options_of(job, scene, factors, course);
    panel_precision precision = PANEL_F32;
    build_problem problem;
    TRY(scene_find_importance(job, scene, plan, factors, error));
    TRY(problem_of(scene, factors, needs_of(how.method), &problem, error));
    TRY(build_operator(&problem, &how, &made->op, &made->built, error));
    if (!(method_find(made->built.method)->flags & METHOD_READS)) importance_free(&scene->importance);
    if (plan->streamed) {
        form_factors_free(&factors->f);
        factors->f = ray_rows_take(factors->rays);
        ray_rows_destroy(factors->rays);
        factors->rays = NULL;
    }
    log_report(job, factors, made);
    lam_operator_set_threads(made->op, (size_t)omp_get_max_threads());
    (void)panel_precision_find(how.precision, &precision); /* one of the choices of the row */
    TRY(precision_replace(&made->op, precision, scene->m.area, precompute_seed(o->seed, SEED_PRECISION),
                          job->t, error));
done:
    return status;
}

static void log_figures(terminal *t, const char *name, const error_group *g, bool has_total) {
    const char *at_most = g->is_bound ? "at most " : "";
    char probes[64] = "";
    if (g->probes == 0) return;
    if (g->probes_noise > 0)
        snprintf(probes, sizeof probes, ", of %zu probes %.2g", g->probes, g->probes_noise);
    if (has_total)
        terminal_log(t, "%-8s total relative %s%.3g, indirect %s%.3g (noise of the reference %.2g%s)", name,
                     at_most, g->total_relative.mean, at_most, g->total_indirect.mean, g->reference_noise,
                     probes);
    if (g->operator_probes > 0)
        terminal_log(t, "%-8s operator relative %.3g, indirect %.3g", name, g->operator_relative.mean,
                     g->operator_indirect.mean);
    if (!g->receivers.known) return;
    const receiver_figures *r = &g->receivers;
    at_most = r->is_bound ? "at most " : "";
    if (has_total)
        terminal_log(t, "%-8s receivers relative %s%.3g, indirect %s%.3g (noise of the reference %.2g)", name,
                     at_most, r->total_relative, at_most, r->total_indirect, r->noise);
}

/* Rows that were not held are found again: the error of the operator itself is measured against them. */
static lam_status trace_again(const precompute_job *job, const precompute_scene *scene,
                              const precompute_plan *plan, precompute_factors *factors, lam_error *error) {
    const form_factor_options how = {
        .recipe = plan->recipe, .progress = &job->progress, .stage = "form factors once more for the judge"};
    form_factors again = {.row_sums = NULL};
    const lam_status status = form_factors_make(&scene->m, scene->order, &how, &again, error);
    factors->f.F = again.F;
    again.F = (csr){.n = 0};
    form_factors_free(&again);
    return status;
}

/* The first method whose epsilon is kept. */
static const char *keeper(void) {
    for (size_t k = 0; method_at(k) != NULL; k++)
        if (method_at(k)->flags & METHOD_KEEPS_EPSILON) return method_at(k)->name;
    return NULL;
}

void stage_advise(const finished_trial *t, char advice[ERROR_ADVICE_BYTES]) {
    const precompute_options *o = t->job->options;
    const trial_course *course = t->course;
    const form_factors *f = &t->factors->f;
    const bool all_tried = course->count == o->trials && o->trials < TRIALS_MOST;
    const worst_group worst = judge_worst_group(&t->made->by_group);
    const bool known = worst.group < t->made->by_group.n_groups;
    const error_advice_input input = {.errors = &t->made->errors,
                                      .recipe = f->recipe,
                                      .asked = trial_keeps_epsilon(t) ? t->job->kept_epsilon : 0,
                                      .group_asked = o->group_error,
                                      .worst = &worst,
                                      .worst_name = known ? t->scene->m.group_names[worst.group] : "",
                                      .trials_left = all_tried ? TRIALS_MOST : 0,
                                      .other_method = trial_follows_epsilon(t) ? NULL : keeper(),
                                      .epsilon = course->epsilon,
                                      .lacking = course->lacking,
                                      .spent = course->spent,
                                      .by_noise = t->made->built.by_noise,
                                      .finest = o->quality == QUALITY_HIGH ||
                                                f->recipe.accuracy <= plan_finest_accuracy(),
                                      .overlapping = made_is_overlapping(t->scene, t->made),
                                      .from_store = o->from_store};
    if (t->plan->probes == 0) return;
    error_advice(&input, advice);
    if (advice[0] != '\0') terminal_warn(t->job->t, "%s", advice);
    char of_sky[ERROR_ADVICE_BYTES];
    error_advice_sky(&input, f->leaving_share, f->n_aimed + mesh_pane_groups(&t->scene->m), of_sky);
    if (of_sky[0] != '\0') terminal_warn(t->job->t, "%s", of_sky);
}

/* Context of log_half. */
typedef struct half_log {
    const precompute_job *job;
    size_t n;
} half_log;

static void log_half(void *context, const form_factors *half) {
    const half_log *to = context;
    factors_log_kept(to->job, to->n, half);
}

lam_status stage_judge(const precompute_job *job, precompute_scene *scene, const precompute_plan *plan,
                       precompute_factors *factors, made_operator *made, judge_references **kept,
                       lam_error *error) {
    lam_status status = LAM_OK;
    half_log to = {job, scene->m.n};
    const uint64_t seed = job->options->seed;
    build_problem problem;
    if (plan->streamed) TRY(trace_again(job, scene, plan, factors, error));
    TRY(problem_of(scene, factors, 0, &problem, error));
    judging j = {.m = &scene->m,
                 .order = scene->order,
                 .problem = &problem,
                 .f = &factors->f,
                 .openings = scene->openings,
                 .importance = scene->importance.n > 0 ? &scene->importance : NULL,
                 .scratch_names = {"judge-1.rows", "judge-2.rows"},
                 .stages = {"form factors for the judge, 1 of 2", "form factors for the judge, 2 of 2"},
                 .scratch = factors->scratch,
                 .large = factors_place(plan, factors),
                 .probes_seed = precompute_seed(seed, SEED_PROBES),
                 .first_light_seed = precompute_seed(seed, SEED_FIRST_LIGHT),
                 .probes = plan->probes,
                 .probes_least = job->options->probes == OPTION_AUTO ? PROBES_LEAST : 0,
                 .by_group = &made->by_group,
                 .progress = &job->progress,
                 .sampled = log_half,
                 .context = &to,
                 .kept = kept};
    uint64_t purpose = SEED_JUDGE_FIRST, own;
    for (int h = 0; h < 2; h++) {
        /* Independent of the F that was factorized: kept form factors may have any seed. */
        do own = precompute_seed(seed, purpose++);
        while (own == factors->f.recipe.seed);
        j.halves[h] = plan_judge_recipe(job, plan, (double)scene->m.n, own);
    }
    TRY(judging_run(&j, made->op, &made->errors, error));
    if (scene->importance.emits != NULL) terminal_log(job->t, "errors of emissions of the sources alone:");
    log_figures(job->t, "single", &made->errors.single, made->errors.has_total);
    log_figures(job->t, "lights", &made->errors.lights, made->errors.has_total);
    log_figures(job->t, "random", &made->errors.random, made->errors.has_total);
    log_figures(job->t, "whole", &made->errors.whole, made->errors.has_total);
    log_figures(job->t, "sky", &made->errors.sky, made->errors.has_total);
done:
    return status;
}
