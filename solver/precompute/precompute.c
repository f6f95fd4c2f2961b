/* A run from the input to a sealed store: the stages in their order, each handed the parts that it may touch
 * (parts.h), and the trials of form factors, operator and judge until an error that was asked for is kept. */
#include "solver/precompute/precompute.h"

#include "solver/base/clock.h"
#include "solver/base/random.h"
#include "solver/method/emitters_options.h"
#include "solver/precompute/plan.h"
#include "solver/precompute/stages.h"

#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

uint64_t precompute_seed(uint64_t seed, seed_purpose purpose) {
    return random_mix(seed + (uint64_t)purpose * RANDOM_STEP);
}

static void log_stage(const precompute_job *job, const char *stage, double started) {
    terminal_log_stage(job->t, stage, clock_seconds() - started);
}

/* The options among those given that the method had no use for: a row of another method's table, or one whose
 * own method says that the others leave it no effect. */
static void list_unused(const precompute_job *job, const precompute_plan *plan, const made_operator *made,
                        const option_result *given, char list[256]) {
    const build_method *built = method_find(made->built.method);
    const build_options *o = &job->options->build;
    size_t length = 0;
    list[0] = '\0';
    for (size_t i = 0; i < given->n_given; i++) {
        const char *name = given->given[i];
        bool unused = method_has_option(NULL, name) && !method_has_option(built, name);
        if (!unused && built->ignores != NULL && method_has_option(built, name))
            unused = built->ignores(method_own_const(o, built), &made->built, name);
        if (strcmp(name, "epsilon") == 0 && recipe_can(&plan->recipe, SOURCE_COARSER) &&
            plan_pairs_follow_epsilon(job, built))
            unused = false;
        if (strcmp(name, "store-precision") == 0) unused = made->op->kind->narrow == NULL;
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
static lam_status run_trial(precompute_parts *p, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_job *job = &p->job;
    const bool first = p->course.count == 0, streamed = p->plan.streamed;
    const finished_trial now = parts_view(p);
    double started = clock_seconds(), used = clock_processor_seconds();
    if (p->factors.f.row_sums == NULL) {
        TRY(stage_factors(job, &p->scene, &p->plan, &p->factors, error));
        log_stage(job, streamed ? "near pairs" : "form factors", started);
    }
    if (first) p->times.spent.form_factors = since(&used);
    if (!streamed && first) factors_log(job, &p->scene, &p->factors);

    TRY(stage_operator(job, &p->scene, &p->plan, &p->factors, &p->made, &p->course, error));
    if (first) p->times.spent.operate = since(&used);
    if (streamed && first) factors_log(job, &p->scene, &p->factors);
    if (first) TRY(factors_warn_of_backs(job, &p->scene, &p->factors, error));
    TRY(terminal_check(error));

    if (p->plan.probes > 0) {
        judge_references **kept = trial_may_be_repeated(&now) ? &p->course.references : NULL;
        started = clock_seconds();
        TRY(stage_judge(job, &p->scene, &p->plan, &p->factors, &p->made, kept, error));
        log_stage(job, "judge", started);
    }
    if (first) p->times.spent.judge = since(&used);
    if (first && streamed) { /* rows are found as the operator asks for them */
        forecast_times *const times[] = {&p->times.expected, &p->times.spent};
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
static lam_status run_trials(precompute_parts *p, lam_error *error) {
    lam_status status = LAM_OK;
    const finished_trial now = parts_view(p);
    do {
        status = run_trial(p, error);
        if (status == LAM_ERR_MEMORY && p->course.best.op != NULL) {
            terminal_warn(p->job.t, "trial %zu: %s", p->course.count + 1, error->message);
            *error = (lam_error){.message = ""};
            trial_take_back(&p->factors, &p->made, &p->course);
            break;
        }
        TRY(status);
    } while (stage_next_trial(&p->job, &p->scene, &p->plan, &p->factors, &p->made, &p->course));
    made_add_overlap(&p->job, &p->scene, &p->plan, &p->factors, &p->made);
    judge_references_free(p->course.references);
    p->course.references = NULL;
    trial_report(&now, &p->made.built);
    times_log(&p->job, &p->times);
    stage_advise(&now, p->made.advice);
    status = LAM_OK;
done:
    return status;
}

/* The direct light of luminaires, once the mesh is made. */
static lam_status run_luminaires(precompute_parts *p, lam_error *error) {
    lam_status status = LAM_OK;
    const double started = clock_seconds();
    if (p->scene.luminaires.placed.n == 0) return LAM_OK;
    TRY(stage_luminaires(&p->job, &p->scene, error));
    TRY(scene_light_sources(&p->job, &p->scene, error));
    log_stage(&p->job, "luminaires", started);
    TRY(terminal_check(error));
done:
    return status;
}

/* All from the input to an operator and its errors, by form factors. */
static lam_status run_stages(precompute_parts *p, lam_error *error) {
    lam_status status = LAM_OK;
    precompute_job *job = &p->job;
    double started = clock_seconds();
    TRY(job->options->from_store ? stage_load_store(job, &p->scene, &p->plan, &p->factors, error)
                                 : stage_load_scene(job, &p->scene, error));
    log_stage(job, "import", started);
    TRY(terminal_check(error));

    started = clock_seconds();
    TRY(stage_prepare_mesh(job, &p->scene, &p->plan, error));
    TRY(scene_read_at_sensors(job, &p->scene, error));
    /* The way in which form factors are found may depend on sources, which are then found first. */
    const bool by_luminaires = p->scene.importance.luminaires;
    if (by_luminaires) TRY(run_luminaires(p, error));
    if (job->options->time > 0) {
        TRY(plan_within_time(job, &p->scene, &p->plan, &p->times, &p->chosen, error));
        job->options = &p->chosen;
        job->kept_epsilon = p->course.epsilon = p->chosen.build.epsilon;
    }
    TRY(stage_choose_plan(job, &p->scene, &p->plan, error));
    log_stage(job, "mesh", started);
    TRY(terminal_check(error));

    if (!by_luminaires) TRY(run_luminaires(p, error));
    TRY(stage_open_scratch(job, &p->plan, &p->factors, error));
    TRY(stage_forecast(job, &p->scene, &p->plan, &p->factors, &p->times, error));
    TRY(run_trials(p, error));
    if (p->scene.sensors.list.n > 0) {
        started = clock_seconds();
        TRY(stage_sensors(job, &p->scene, &p->factors.f.sky, true, error));
        log_stage(job, "sensors", started);
    }
    if (p->plan.probes > 0) {
        TRY(stage_mesh_error(job, &p->scene, &p->factors, &p->made, error));
        TRY(stage_own_error(&p->scene, &p->made, error));
    }
done:
    return status;
}

lam_status precompute_run(const precompute_options *options, const option_result *given, terminal *t,
                          precompute_result *result, lam_error *error) {
    lam_status status = LAM_OK;
    precompute_parts p = parts_begin(options, t);
    if (options_given(given, "epsilon")) p.job.kept_epsilon = options->build.epsilon;
    if (relight_is_asked(options, given)) {
        TRY(relight_run(&p.job, &p.scene, error));
        goto done;
    }
    TRY(emitters_are_positions(emitters_options_of(&options->build))
            ? stage_positions(&p.job, &p.scene, &p.made, &p.walked, error)
            : run_stages(&p, error));
    const double started = clock_seconds();
    TRY(stage_store(&p.job, &p.scene, &p.plan, &p.factors, &p.made, &p.walked, error));
    log_stage(&p.job, "store", started);
    scratch_close(p.factors.scratch, true);
    p.factors.scratch = NULL;
    result->report = p.made.built;
    result->n_faces = p.scene.n_faces;
    result->forecast = p.times.expected;
    result->spent = p.times.spent;
    memcpy(result->advice, p.made.advice, sizeof result->advice);
    list_unused(&p.job, &p.plan, &p.made, given, result->unused);
done:
    parts_free(&p);
    return status;
}
