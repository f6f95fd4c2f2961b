#include "solver/precompute/precompute.h"
#include "solver/formfactor/facing.h"

#include "solver/base/clock.h"
#include "solver/base/random.h"
#include "solver/method/emitters_options.h"
#include "solver/precompute/precompute_state.h"

#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static double memory_of(const precompute_options *o) {
    const uint64_t available = memory_available();
    if (o->memory > 0) return (double)o->memory;
    return available > 0 ? .7 * (double)available : 0x1p60;
}

precompute_state state_begin(const precompute_options *options, terminal *t) {
    return (precompute_state){.options = options,
                              .t = t,
                              .progress = terminal_progress(t),
                              .memory = memory_of(options),
                              .trial = {.epsilon = options->build.epsilon}};
}

void state_free(precompute_state *state) {
    mesh_free(&state->m);
    free(state->order);
    free(state->centre);
    free(state->surface);
    form_factors_free(&state->f);
    face_openings_free(&state->of_faces);
    ray_rows_destroy(state->rays);
    block_scene_destroy(state->ready);
    plane_tree_free(&state->tree);
    block_factors_free(&state->blocks);
    emitter_list_free(&state->emitters);
    importance_free(&state->importance);
    scratch_close(state->scratch, false);
    moving_light_free(&state->light);
    reuse_estimates_free(&state->paths);
    free(state->position_errors);
    lam_operator_close(state->op);
    group_errors_free(&state->by_group);
    trial_made_free(&state->trial.best);
    judge_references_free(state->trial.references);
}

uint64_t precompute_seed(uint64_t seed, seed_purpose purpose) {
    return random_mix(seed + (uint64_t)purpose * RANDOM_STEP);
}

static void log_stage(precompute_state *state, const char *stage, double started) {
    terminal_log_stage(state->t, stage, clock_seconds() - started);
}

/* Above this share of leaving light the faces of a room are likely to look outward: a city of 500 elements
 * loses .71. */
static const double outward_share = .9;

/* Says why the scene counts as closed or open. */
static void log_closure(const precompute_state *state) {
    const form_factors *f = &state->f;
    const char *const way = f->closed ? "closed" : "open", *const other = f->closed ? "=no" : "";
    char why[96];
    if (state->options->from_store) return; /* it was decided and said when the form factors were made */
    if (f->recipe.closure != CLOSURE_MEASURED)
        snprintf(why, sizeof why, "as --closed%s says", f->closed ? "" : "=no");
    else if (!(f->leaving_share > 0))
        snprintf(why, sizeof why, "no ray leaves it");
    else if (f->closed)
        snprintf(why, sizeof why, "light leaves through cracks narrower than %.2g m", f->outlet.crack_width);
    else
        snprintf(why, sizeof why, "%.0f %% of the light that leaves passes gaps wider than %.2g m",
                 100 * f->outlet.openings, f->outlet.crack_width);
    if (f->recipe.closure != CLOSURE_MEASURED || !(f->leaving_share > 0))
        terminal_log(state->t, "the scene is %s: %s", way, why);
    else
        terminal_log(state->t, "the scene is %s: %s; --closed%s overrules that", way, why, other);
}

/* Above this, the part of the repair that no samples make is warned of. */
static const double repair_warned = .01;

static void warn_of_repair(const precompute_state *state) {
    const double off = form_factors_repair_error(&state->f);
    if (off > repair_warned)
        terminal_warn(
            state->t,
            "the form factors of an element add up to %.2g %% too much or too little on average, before "
            "the repair: some faces may coincide and count twice, or cut through each other; stated "
            "errors contain it",
            100 * off);
}

static void log_form_factors(precompute_state *state) {
    const form_factors *f = &state->f;
    char how[64];
    recipe_describe(&f->recipe, how);
    terminal_log(state->t,
                 "%s: %.2f %% leave the scene%s, %.2f %% meet back faces; row sums repaired by "
                 "%.2g on average, at most %.2g",
                 how, 100 * f->leaving_share, f->closed ? " (closed)" : "", 100 * f->absorbed_share,
                 f->repair_mean, f->repair_max);
    log_closure(state);
    if (f->leaving_share > outward_share && !state->m.two_sided)
        terminal_log(
            state->t,
            "nearly all light leaves the scene; if this is a room, its faces look outward: turn them, or "
            "give --two-sided");
    if (f->pairs.accuracy > recipe_accuracy(&f->recipe))
        terminal_log(state->t,
                     "many pairs are partly hidden: their factors have a standard error of %.2g, not %.2g; "
                     "--quality high casts more rays for them",
                     f->pairs.accuracy, recipe_accuracy(&f->recipe));
    if (f->pairs.facing > 0) {
        const double all = .5 * (double)state->m.n * (double)(state->m.n - 1), facing = f->pairs.facing;
        terminal_log(
            state->t,
            "%.1f %% of all pairs taken one by one; of those %.1f %% have nothing between them, "
            "%.1f %% are plainly open, %.1f %% plainly hidden, %.1f %% have few occluders, which are "
            "projected",
            100 * facing / all, 100 * f->pairs.certain / facing, 100 * f->pairs.open / facing,
            100 * f->pairs.hidden / facing, 100 * f->pairs.projected / facing);
    }
    state_log_blocks(state);
    warn_of_repair(state);
    const sky_bounce *sky = &f->sky;
    char aimed[64] = "";
    if (f->n_aimed > 0)
        snprintf(aimed, sizeof aimed, "; rays are aimed at %zu opening%s", f->n_aimed,
                 f->n_aimed == 1 ? "" : "s");
    if (sky->first_bounce != NULL)
        terminal_log(state->t, "sky: %s, %zu tiles, ground albedo %g%s", sky->tiling.name,
                     sky->tiling.n_tiles, sky->ground_albedo, aimed);
    if (sky->first_bounce != NULL && f->closed)
        terminal_warn(state->t, "the scene is closed: no element sees the sky");
}

/* Above this share of light that meets backs, faces are likely to be turned. */
static const double backs_share = .01;

/* Names the groups whose backs take light. */
static lam_status warn_of_backs(precompute_state *state, lam_error *error) {
    lam_status status = LAM_OK;
    const form_factors *f = &state->f;
    const mesh *m = &state->m;
    facing_survey survey = {.share = 0};
    char groups[256] = "";
    size_t used = 0, left = 0;
    if (!(f->absorbed_share > backs_share) || m->two_sided) return LAM_OK;
    TRY(facing_survey_make(m, &survey, error));
    for (size_t g = 0; g < m->n_groups; g++) left += survey.group_shares[g] > 0;
    for (int k = 0; k < 3 && left > 0; k++, left--) { /* the largest first */
        size_t most = 0;
        for (size_t g = 1; g < m->n_groups; g++)
            if (survey.group_shares[g] > survey.group_shares[most]) most = g;
        used += (size_t)snprintf(groups + used, sizeof groups - used, "%s%.60s %.1f %%", k == 0 ? "" : ", ",
                                 m->group_names[most], 100 * survey.group_shares[most]);
        survey.group_shares[most] = 0;
    }
    if (left > 0) snprintf(groups + used, sizeof groups - used, ", %zu more", left);
    terminal_warn(
        state->t,
        "%.1f %% of the light meets the backs of %zu faces or more and is lost there (%s): --orient turns "
        "faces where rays can decide it, and with --two-sided both sides reflect",
        100 * survey.share, survey.faces, groups);
done:
    facing_survey_free(&survey);
    return status;
}

void state_log_kept(precompute_state *state, const form_factors *f) {
    if (f->rows_kept > 0)
        terminal_log(state->t, "%zu of %zu rows were in %s already", f->rows_kept, state->m.n,
                     state->options->scratch);
}

lam_status stage_form_factors(precompute_state *state, lam_error *error) {
    lam_status status = LAM_OK;
    state->recipe.closure = state->options->closed;
    const form_factor_options how = {.recipe = state->recipe,
                                     .progress = &state->progress,
                                     .stage = "form factors",
                                     .scratch = state->scratch,
                                     .scratch_name = "form-factors.rows",
                                     .large = state_large_place(state),
                                     .sky = state->options->sky,
                                     .openings = state->openings,
                                     .ground_albedo = state->options->ground_albedo};
    TRY(form_factors_make(&state->m, state->order, &how, &state->f, error));
    state_log_kept(state, &state->f);
done:
    return status;
}

lam_status stage_near_pairs(precompute_state *state, lam_error *error) {
    state->recipe.closure = state->options->closed;
    const form_factor_options how = {.recipe = state->recipe,
                                     .progress = &state->progress,
                                     .stage = "near pairs",
                                     .sky = state->options->sky,
                                     .openings = state->openings,
                                     .ground_albedo = state->options->ground_albedo};
    const lam_status status = ray_rows_create(&state->m, &how, &state->rays, error);
    if (status == LAM_OK)
        ray_rows_stream(state->rays, precompute_seed(state->options->seed, SEED_OTHER_ROWS), &state->stream);
    state->f.recipe = state->recipe;
    return status;
}

/* The options among those given that the method had no use for: a row of another method's table, or one whose
 * own method says that the others leave it no effect. */
static void list_unused(const precompute_state *state, const option_result *given, char list[256]) {
    const build_method *built = method_find(state->built.method);
    const build_options *o = &state->options->build;
    size_t length = 0;
    list[0] = '\0';
    for (size_t i = 0; i < given->n_given; i++) {
        const char *name = given->given[i];
        bool unused = method_has_option(NULL, name) && !method_has_option(built, name);
        if (!unused && built->ignores != NULL && method_has_option(built, name))
            unused = built->ignores(method_own_const(o, built), &state->built, name);
        if (strcmp(name, "epsilon") == 0 && recipe_source(&state->recipe) == &source_pairs &&
            state_pairs_follow_epsilon(state, built))
            unused = false;
        if (strcmp(name, "store-precision") == 0) unused = state->op->kind->narrow == NULL;
        if (unused && length + strlen(name) + 5 < 256)
            length += (size_t)sprintf(list + length, "%s--%s", length > 0 ? ", " : "", name);
    }
}

/* Processor seconds since *used, which becomes now. */
static double since(double *used) {
    const double before = *used;
    *used = clock_processor_seconds();
    return *used - before;
}

/* Form factors, unless they are there, operator and judge. */
static lam_status run_trial(precompute_state *state, lam_error *error) {
    lam_status status = LAM_OK;
    const bool first = state->trial.count == 0;
    double started = clock_seconds(), used = clock_processor_seconds();
    const bool made = state->f.row_sums != NULL;
    if (recipe_source(&state->recipe) != &source_blocks) state_forget_ready(state);
    if (!made) {
        TRY(recipe_source(&state->recipe) == &source_blocks ? stage_blocks(state, error)
            : state->streamed                               ? stage_near_pairs(state, error)
                                                            : stage_form_factors(state, error));
        log_stage(state, state->streamed ? "near pairs" : "form factors", started);
    }
    if (first) state->spent.form_factors = since(&used);
    if (!state->streamed && first) log_form_factors(state);

    TRY(stage_operator(state, error));
    if (first) state->spent.operate = since(&used);
    if (state->streamed && first) log_form_factors(state);
    if (first) TRY(warn_of_backs(state, error));
    TRY(terminal_check(error));

    if (state->probes > 0) {
        started = clock_seconds();
        TRY(stage_judge(state, error));
        log_stage(state, "judge", started);
    }
    if (first) state->spent.judge = since(&used);
    if (first && state->streamed) { /* rows are found as the operator asks for them */
        forecast_times *const times[] = {&state->expected_times, &state->spent};
        for (int k = 0; k < 2; k++) {
            times[k]->operate += times[k]->form_factors;
            times[k]->form_factors = 0;
        }
    }
    TRY(terminal_check(error));
done:
    return status;
}

/* Trials until --epsilon and --group-error are kept. One that memory has no room for leaves the best of those
 * before. */
static lam_status run_trials(precompute_state *state, lam_error *error) {
    lam_status status = LAM_OK;
    do {
        status = run_trial(state, error);
        if (status == LAM_ERR_MEMORY && state->trial.best.op != NULL) {
            terminal_warn(state->t, "trial %zu: %s", state->trial.count + 1, error->message);
            *error = (lam_error){.message = ""};
            state_take_back(state);
            break;
        }
        TRY(status);
    } while (state_next_trial(state));
    state_add_overlap(state);
    state_report_trials(state);
    state_log_times(state);
    state_advise(state);
    status = LAM_OK;
done:
    return status;
}

/* All from the input to an operator and its errors, by form factors. */
static lam_status run_stages(precompute_state *state, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *options = state->options;
    double started = clock_seconds();
    TRY(options->from_store ? stage_load_store(state, error) : stage_load_scene(state, error));
    log_stage(state, "import", started);
    TRY(terminal_check(error));

    started = clock_seconds();
    TRY(stage_prepare_mesh(state, error));
    log_stage(state, "mesh", started);
    TRY(terminal_check(error));

    TRY(stage_open_scratch(state, error));
    TRY(stage_forecast(state, error));
    TRY(run_trials(state, error));
    if (state->probes > 0) TRY(stage_mesh_error(state, error));
done:
    return status;
}

lam_status precompute_run(const precompute_options *options, const option_result *given, terminal *t,
                          precompute_result *result, lam_error *error) {
    lam_status status = LAM_OK;
    precompute_state state = state_begin(options, t);
    if (options_given(given, "epsilon")) state.trial.asked = options->build.epsilon;
    state.trial.group = options->group_error;

    state.started = clock_seconds();
    state.started_used = clock_processor_seconds();
    TRY(emitters_are_positions(emitters_options_of(&options->build)) ? stage_positions(&state, error)
                                                                     : run_stages(&state, error));
    const double started = clock_seconds();
    TRY(stage_store(&state, error));
    log_stage(&state, "store", started);
    scratch_close(state.scratch, true);
    state.scratch = NULL;
    result->report = state.built;
    result->forecast = state.expected_times;
    result->spent = state.spent;
    memcpy(result->advice, state.advice, sizeof result->advice);
    list_unused(&state, given, result->unused);
done:
    state_free(&state);
    return status;
}
