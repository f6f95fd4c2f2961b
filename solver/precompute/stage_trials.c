/* --epsilon and --group-error kept: after a trial, that is form factors, operator and judge, either it is
 * good enough, or the next one gets finer knobs (trial.h). The best stays. */
#include "solver/precompute/error_advice.h"
#include "solver/precompute/plan.h"
#include "solver/precompute/stages.h"

#include <stdlib.h>

void trial_made_free(trial_made *made) {
    form_factors_free(&made->f);
    block_factors_free(&made->blocks);
    lam_operator_close(made->op);
    group_errors_free(&made->by_group);
    *made = (trial_made){.op = NULL};
}

/* Puts the operator of the trial that just ended aside. */
static void set_aside(made_operator *made, trial_course *course, double excess) {
    trial_made_free(&course->best);
    course->best = (trial_made){.op = made->op,
                                .built = made->built,
                                .errors = made->errors,
                                .by_group = made->by_group,
                                .epsilon = course->epsilon,
                                .excess = excess};
    made->op = NULL;
    made->by_group = (group_errors){.n_groups = 0};
}

/* Makes room for other form factors. The operator put aside keeps those that it was built from, their rows
 * only where the store keeps them. */
static void release_factors(const precompute_job *job, precompute_factors *factors, trial_course *course) {
    trial_made *best = &course->best;
    if (!job->options->keep_form_factors) {
        csr_free(&factors->f.F);
        block_factors_free(&factors->blocks);
    }
    if (best->f.row_sums == NULL) {
        best->f = factors->f;
        best->blocks = factors->blocks;
    } else {
        form_factors_free(&factors->f);
        block_factors_free(&factors->blocks);
    }
    factors->f = (form_factors){.row_sums = NULL};
    factors->blocks = (block_factors){.n = 0};
}

void trial_take_back(precompute_factors *factors, made_operator *made, trial_course *course) {
    trial_made *best = &course->best;
    lam_operator_close(made->op);
    made->op = best->op;
    made->built = best->built;
    made->errors = best->errors;
    group_errors_free(&made->by_group);
    made->by_group = best->by_group;
    best->by_group = (group_errors){.n_groups = 0};
    course->epsilon = best->epsilon;
    best->op = NULL;
    if (best->f.row_sums == NULL) return;
    form_factors_free(&factors->f);
    block_factors_free(&factors->blocks);
    factors->f = best->f;
    factors->blocks = best->blocks;
    best->f = (form_factors){.row_sums = NULL};
    best->blocks = (block_factors){.n = 0};
}

static bool is_judged_keeper(const finished_trial *t) {
    return t->plan->probes > 0 && (method_find(t->made->built.method)->flags & METHOD_KEEPS_EPSILON) != 0;
}

bool trial_keeps_epsilon(const finished_trial *t) {
    return t->job->kept_epsilon > 0 && is_judged_keeper(t);
}

static bool keeps_group_error(const finished_trial *t) {
    return t->job->options->group_error > 0 && t->plan->probes > 0;
}

/* Without --epsilon and --group-error the error that calls for a warning is kept where a finer threshold can
 * do it for next to nothing: an operator costs a small part of form factors pair by pair. */
static bool keeps_preset(const finished_trial *t) {
    return t->job->kept_epsilon == 0 && !keeps_group_error(t) && is_judged_keeper(t) &&
           recipe_can(&t->factors->f.recipe, SOURCE_TWICE);
}

/* The error of the lights, or of random emission, to keep; 0: none. */
static double asked_of(const finished_trial *t) {
    if (trial_keeps_epsilon(t)) return t->job->kept_epsilon;
    return keeps_preset(t) ? error_advice_most : 0;
}

/* The goal of which most is lacking; *group: it is that of --group-error. */
static trial_goal goal_of(const finished_trial *t, bool *group) {
    const bool by_noise = t->made->built.by_noise;
    const worst_group worst = judge_worst_group(&t->made->by_group);
    const trial_goal of_group = trial_goal_of_group(t->job->options->group_error, &worst, by_noise);
    const trial_goal of_epsilon = {.asked = asked_of(t),
                                   .errors = trial_errors_of(trial_group(&t->made->errors), by_noise)};
    *group = keeps_group_error(t) &&
             (!trial_keeps_epsilon(t) || trial_excess(&of_group) > trial_excess(&of_epsilon));
    return *group ? of_group : of_epsilon;
}

/* Bytes of the next trial, beside the operator, and where they are kept the form factors, of this one. */
static double bytes_of(const finished_trial *t, const trial_knobs *next) {
    precompute_plan other = *t->plan;
    const bool again = recipes_differ(&t->plan->recipe, &next->recipe);
    build_options how = build_options_of(t->job, t->scene, t->factors, t->course);
    lam_error none;
    double beside = (double)lam_operator_bytes(t->made->op);
    if (again && t->job->options->keep_form_factors)
        beside += recipe_source(&t->plan->recipe)->bytes((double)t->scene->m.n, &t->plan->recipe);
    (void)build_set_number(&how, "epsilon", next->epsilon, &none); /* below one that is in its limits */
    other.recipe = next->recipe;
    other.streamed = t->plan->streamed && again; /* else the judge's rows are there */
    forecast f = plan_forecast(t->job, t->scene, &other, (double)t->scene->m.n);
    f.build = &how;
    f.cost = (factor_cost){.seconds = 0};
    return forecast_bytes(&f) + beside;
}

/* Takes turns back until memory suffices: rays are halved, blocks made coarser; false where none is left. */
static bool fit(const finished_trial *t, const trial_knobs *from, trial_knobs *next, double *lacking) {
    while (bytes_of(t, next) > t->job->memory) {
        recipe *r = &next->recipe;
        *lacking = bytes_of(t, next);
        if (!recipes_differ(&from->recipe, r)) return false;
        r->rays = r->rays / 2 > from->recipe.rays ? r->rays / 2 : from->recipe.rays;
        r->accuracy = r->accuracy * 2 < from->recipe.accuracy ? r->accuracy * 2 : from->recipe.accuracy;
    }
    return next->epsilon != from->epsilon || recipes_differ(&from->recipe, &next->recipe);
}

bool trial_follows_epsilon(const finished_trial *t) {
    const build_method *m = method_find(t->made->built.method);
    const build_options *o = &t->job->options->build;
    return method_has_option(m, "epsilon") &&
           (m->ignores == NULL || !m->ignores(method_own_const(o, m), &t->made->built, "epsilon"));
}

/* Rows of a store are as they are, and those of a scratch folder are kept for a run that goes on. */
static trial_limits limits_of(const finished_trial *t) {
    const precompute_options *o = t->job->options;
    const bool anew = !o->from_store && o->scratch == NULL && !t->course->spent && !keeps_preset(t);
    return (trial_limits){.rays = anew && o->rays == OPTION_AUTO,
                          .accuracy = anew,
                          .fixed_epsilon = !trial_follows_epsilon(t),
                          .finest = plan_finest_accuracy()};
}

/* Finer form factors are no use where they left more than this share of their part of the error: a finer
 * bound changes nothing where blocks are single pairs of elements. */
static const double spent_share = .9;

/* The worst of many groups is another one as soon as it is better, so that it follows no law closely. The
 * last trial, after which nothing can be mended, aims lower: with receivers .9 stopped at .051 for .05. */
static const double last_share = .6;

/* The knobs of the next trial; false: there is none, as nothing can be turned. */
static bool turn(const finished_trial *t, trial_course *course, const trial_knobs *from, trial_knobs *next) {
    bool group;
    const trial_goal goal = goal_of(t, &group);
    const bool same = group == course->group_missed && course->missed.asked > 0;
    course->spent = course->spent || (course->factors > 0 && same &&
                                      goal.errors.factors / goal.asked > spent_share * course->factors);
    trial_limits limits = limits_of(t);
    if (same && group)
        limits.power = trial_power(from->epsilon, goal.errors.compression, course->before.epsilon,
                                   course->missed.errors.compression);
    if (group && course->count + 1 == t->job->options->trials) limits.aimed_share = last_share;
    course->factors = 0;
    course->lacking = 0;
    if (!trial_turn(goal.asked, &goal.errors, &limits, from, next)) return false;
    if (fit(t, from, next, &course->lacking)) return true;
    limits.rays = limits.accuracy = false;
    return trial_turn(goal.asked, &goal.errors, &limits, from, next) && fit(t, from, next, &course->lacking);
}

static bool keeps_any(const finished_trial *t) {
    return asked_of(t) > 0 || keeps_group_error(t);
}

bool trial_may_be_repeated(const finished_trial *t) {
    return keeps_any(t) && t->course->count + 1 < t->job->options->trials;
}

/* The form factors of the judge stay where those of the operator do, and all of its references where memory
 * has room for them beside the next operator. */
static void release_references(const finished_trial *t, const trial_knobs *next, bool same,
                               judge_references **r) {
    if (!same) judge_references_free_samples(*r);
    if (bytes_of(t, next) + judge_references_bytes(*r) <= t->job->memory) return;
    judge_references_free(*r);
    *r = NULL;
}

/* Says what the trial has, and what is turned next. */
static void log_trial(const finished_trial *t, const trial_goal *goal, bool group, const char *knobs) {
    const error_group *g = trial_group(&t->made->errors);
    const worst_group worst = judge_worst_group(&t->made->by_group);
    const char *next = knobs[0] != '\0' ? "; next: " : "";
    char what[TRIAL_WORST_TEXT];
    if (!group) {
        terminal_log(
            t->job->t, "trial %zu: the indirect error of %s is stated as %.2g, %s %g%s%s", t->course->count,
            g == &t->made->errors.lights ? "the scene's own lights" : "random emission", goal->errors.total,
            trial_keeps_epsilon(t)             ? "--epsilon asks for"
            : goal->errors.total > goal->asked ? "above"
                                               : "at most",
            goal->asked, next, knobs);
        return;
    }
    if (worst.group == t->made->by_group.n_groups) {
        terminal_log(t->job->t, "trial %zu: no group has reflected light, --group-error has nothing to keep",
                     t->course->count);
        return;
    }
    trial_describe_worst(&worst, t->scene->m.group_names[worst.group], what);
    terminal_log(t->job->t, "trial %zu: the error of %s is stated as %.2g, --group-error asks for %g%s%s",
                 t->course->count, what, goal->errors.total, goal->asked, next, knobs);
}

bool stage_next_trial(const precompute_job *job, const precompute_scene *scene, precompute_plan *plan,
                      precompute_factors *factors, made_operator *made, trial_course *course) {
    const finished_trial now = {job, scene, plan, factors, made, course};
    const trial_knobs from = {.epsilon = course->epsilon, .recipe = plan->recipe};
    trial_knobs next = from;
    char knobs[TRIAL_TEXT] = "";
    bool group;
    const trial_goal goal = goal_of(&now, &group);
    const double excess = trial_excess(&goal);
    if (!keeps_any(&now)) return false;
    course->count++;
    const bool better = course->best.op == NULL || excess < course->best.excess;
    const bool again = excess > 1 && course->count < job->options->trials && turn(&now, course, &from, &next);
    if (!again && course->count == 1 && keeps_preset(&now)) {
        course->count = 0; /* nobody asked for a trial */
        return false;
    }
    if (again) trial_describe(&from, &next, knobs);
    log_trial(&now, &goal, group, knobs);
    if (!again) {
        if (!better) trial_take_back(factors, made, course);
        return false;
    }
    release_references(&now, &next, !recipes_differ(&from.recipe, &next.recipe), &course->references);
    if (better) set_aside(made, course, excess);
    lam_operator_close(made->op);
    made->op = NULL;
    if (recipes_differ(&from.recipe, &next.recipe)) {
        course->factors = goal.errors.factors / goal.asked;
        release_factors(job, factors, course);
    } else {
        plan->streamed = false; /* the rows are there, as the judge needed them */
    }
    course->before = from;
    course->missed = goal;
    course->group_missed = group;
    plan->recipe = next.recipe;
    course->epsilon = next.epsilon;
    return true;
}

void trial_report(const finished_trial *t, build_report *r) {
    if (t->course->count == 0) return;
    if (trial_keeps_epsilon(t)) {
        report_number(r, "epsilon", t->job->kept_epsilon);
        report_number(r, "epsilon_stated", judge_total(trial_group(&t->made->errors)));
    }
    if (keeps_group_error(t)) {
        report_number(r, "group_error", t->job->options->group_error);
        report_number(r, "group_error_stated", judge_worst_group(&t->made->by_group).total);
    }
    report_count(r, "trials", (double)t->course->count);
}
