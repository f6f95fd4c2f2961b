/* The operator of a precompute and its measured errors. */
#include "solver/base/random.h"
#include "solver/precompute/judging.h"
#include "solver/precompute/precompute_state.h"
#include "solver/scene/surfaces.h"

#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static lam_status find_geometry(precompute_state *state, unsigned needs, lam_error *error) {
    const mesh *m = &state->m;
    size_t n_surfaces;
    if (state->centre == NULL) {
        state->centre = memory_allocate(m->n, sizeof *state->centre, "centroids", error);
        if (state->centre == NULL) return LAM_ERR_MEMORY;
        for (size_t i = 0; i < m->n; i++) mesh_centroid(m, i, state->centre[i]);
    }
    if (!(needs & METHOD_SURFACES) || state->surface != NULL) return LAM_OK;
    state->surface = memory_allocate(m->n, sizeof *state->surface, "surfaces", error);
    return state->surface == NULL ? LAM_ERR_MEMORY : mesh_surfaces(m, state->surface, &n_surfaces, error);
}

lam_status state_problem(precompute_state *state, unsigned needs, build_problem *problem, lam_error *error) {
    lam_status status = LAM_OK;
    const form_factors *f = &state->f;
    state->emitting = (emitter_source){.s = state->emitters.s,
                                       .names = (const char *const *)state->emitters.names,
                                       .E = state->emitters.light.E,
                                       .n_tiles = f->sky.tiling.n_tiles,
                                       .L = state->emitters.light.L,
                                       .first_bounce = f->sky.first_bounce};
    *problem = (build_problem){.emitters = state->emitters.s > 0 ? &state->emitting : NULL,
                               .n = state->m.n,
                               .n_channels = state->m.n_channels,
                               .area = state->m.area,
                               .reflectance = state->m.reflectance,
                               .F = state->rays != NULL || state->blocks.n > 0 ? NULL : &f->F,
                               .blocks = state->blocks.n > 0 ? &state->blocks : NULL,
                               .stream = state->rays != NULL ? &state->stream : NULL,
                               .order = state->order,
                               .importance = state->importance.n > 0 ? &state->importance : NULL,
                               .noise = recipe_noise(&f->recipe)};
    if (!(needs & METHOD_GEOMETRY)) goto done;
    TRY(find_geometry(state, needs, error));
    problem->centre = (const double(*)[3])state->centre;
    problem->normal = (const float(*)[3])state->m.normal;
    problem->surface = state->surface;
    state->corners =
        (element_corners){(const double(*)[3])state->m.vertices, (const uint32_t(*)[4])state->m.elements};
    problem->corners = &state->corners;
done:
    return status;
}

build_options state_build_options(const precompute_state *state) {
    const csr *F = &state->f.F;
    const double rows = F->place != NULL || F->indptr == NULL ? 0 : (double)F->indptr[state->m.n] * 8;
    build_options how = state->options->build;
    lam_error none;
    how.memory = (size_t)fmax(1, state->memory - rows - 400 * (double)state->m.n);
    how.seed = state->options->seed;
    how.progress = &state->progress;
    if (state->trial.epsilon != how.epsilon) /* of a trial: below one that is in its limits */
        (void)build_set_number(&how, "epsilon", state->trial.epsilon, &none);
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

static void log_report(const precompute_state *state) {
    const build_report *r = &state->built;
    const precompute_options *o = state->options;
    char line[512];
    for (size_t k = 0; k < r->n_steps; k++)
        terminal_log_stage(state->t, r->steps[k].name, r->steps[k].seconds);
    report_line(r, line, sizeof line);
    terminal_log(state->t, "%s", line);
    if (r->below_noise)
        terminal_warn(
            state->t,
            "--epsilon %g is below the sampling noise %.2g of %zu rays: the part of the operator below it is "
            "noise; --rays %zu would fit",
            o->build.epsilon, recipe_noise(&state->f.recipe), state->f.recipe.rays,
            recipe_auto_rays(o->build.epsilon, 1. / 4));
    if (r->doubtful > 0)
        terminal_warn(
            state->t,
            "the operator leaves %.2g of smooth light unexplained, above the %.2g that --epsilon %g "
            "allows: its answers to light of large areas are off by about as much; take another "
            "--method or --form-factors",
            report_get(r, "smooth_residual", 0), r->doubtful, o->build.epsilon);
    terminal_log(state->t, "%s", r->reason);
}

lam_status stage_operator(precompute_state *state, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = state->options;
    const build_options how = state_build_options(state);
    panel_precision precision = PANEL_F32;
    build_problem problem;
    TRY(state_find_importance(state, error));
    TRY(state_problem(state, needs_of(how.method), &problem, error));
    TRY(build_operator(&problem, &how, &state->op, &state->built, error));
    if (!(method_find(state->built.method)->flags & METHOD_READS)) importance_free(&state->importance);
    if (state->streamed) {
        form_factors_free(&state->f);
        state->f = ray_rows_take(state->rays);
        ray_rows_destroy(state->rays);
        state->rays = NULL;
    }
    log_report(state);
    lam_operator_set_threads(state->op, (size_t)omp_get_max_threads());
    (void)panel_precision_find(how.precision, &precision); /* one of the choices of the row */
    TRY(precision_replace(&state->op, precision, state->m.area, precompute_seed(o->seed, SEED_PRECISION),
                          state->t, error));
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
static lam_status trace_again(precompute_state *state, lam_error *error) {
    const form_factor_options how = {.recipe = state->recipe,
                                     .progress = &state->progress,
                                     .stage = "form factors once more for the judge"};
    form_factors again = {.row_sums = NULL};
    const lam_status status = form_factors_make(&state->m, state->order, &how, &again, error);
    state->f.F = again.F;
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

void state_advise(precompute_state *state) {
    const precompute_options *o = state->options;
    const bool all_tried = state->trial.count == o->trials && o->trials < TRIALS_MOST;
    const worst_group worst = judge_worst_group(&state->by_group);
    const bool known = worst.group < state->by_group.n_groups;
    const error_advice_input input = {.errors = &state->errors,
                                      .recipe = state->f.recipe,
                                      .asked = state_keeps_epsilon(state) ? state->trial.asked : 0,
                                      .group_asked = state->trial.group,
                                      .worst = &worst,
                                      .worst_name = known ? state->m.group_names[worst.group] : "",
                                      .trials_left = all_tried ? TRIALS_MOST : 0,
                                      .other_method = state_follows_epsilon(state) ? NULL : keeper(),
                                      .epsilon = state->trial.epsilon,
                                      .lacking = state->trial.lacking,
                                      .spent = state->trial.spent,
                                      .by_noise = state->built.by_noise,
                                      .finest = o->quality == QUALITY_HIGH ||
                                                state->f.recipe.accuracy <= state_finest_accuracy(),
                                      .overlapping = state_is_overlapping(state),
                                      .from_store = o->from_store};
    if (state->probes == 0) return;
    error_advice(&input, state->advice);
    if (state->advice[0] != '\0') terminal_warn(state->t, "%s", state->advice);
    char of_sky[ERROR_ADVICE_BYTES];
    error_advice_sky(&input, state->f.leaving_share, state->f.n_aimed, of_sky);
    if (of_sky[0] != '\0') terminal_warn(state->t, "%s", of_sky);
}

static void log_half(void *context, const form_factors *half) {
    state_log_kept(context, half);
}

lam_status stage_judge(precompute_state *state, lam_error *error) {
    lam_status status = LAM_OK;
    const uint64_t seed = state->options->seed;
    build_problem problem;
    if (state->streamed) TRY(trace_again(state, error));
    TRY(state_problem(state, 0, &problem, error));
    judging j = {.m = &state->m,
                 .order = state->order,
                 .problem = &problem,
                 .f = &state->f,
                 .openings = state->openings,
                 .importance = state->importance.n > 0 ? &state->importance : NULL,
                 .scratch_names = {"judge-1.rows", "judge-2.rows"},
                 .stages = {"form factors for the judge, 1 of 2", "form factors for the judge, 2 of 2"},
                 .scratch = state->scratch,
                 .large = state_large_place(state),
                 .probes_seed = precompute_seed(seed, SEED_PROBES),
                 .first_light_seed = precompute_seed(seed, SEED_FIRST_LIGHT),
                 .probes = state->probes,
                 .probes_least = state->options->probes == OPTION_AUTO ? PROBES_LEAST : 0,
                 .by_group = &state->by_group,
                 .progress = &state->progress,
                 .sampled = log_half,
                 .context = state,
                 .kept = state_may_try_again(state) ? &state->trial.references : NULL};
    uint64_t purpose = SEED_JUDGE_FIRST, own;
    for (int h = 0; h < 2; h++) {
        /* Independent of the F that was factorized: kept form factors may have any seed. */
        do own = precompute_seed(seed, purpose++);
        while (own == state->f.recipe.seed);
        j.halves[h] = state_judge_recipe(state, own);
    }
    TRY(judging_run(&j, state->op, &state->errors, error));
    if (state->importance.emits != NULL) terminal_log(state->t, "errors of emissions of the sources alone:");
    log_figures(state->t, "single", &state->errors.single, state->errors.has_total);
    log_figures(state->t, "lights", &state->errors.lights, state->errors.has_total);
    log_figures(state->t, "random", &state->errors.random, state->errors.has_total);
    log_figures(state->t, "whole", &state->errors.whole, state->errors.has_total);
    log_figures(state->t, "sky", &state->errors.sky, state->errors.has_total);
done:
    return status;
}
