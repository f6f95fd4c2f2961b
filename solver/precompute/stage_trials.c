/* --epsilon and --group-error kept: after a trial, that is form factors, operator and judge, either it is
 * good enough, or the next one gets finer knobs (trial.h). The best stays. */
#include "solver/precompute/error_advice.h"
#include "solver/precompute/precompute_state.h"

#include <stdlib.h>

void trial_made_free(trial_made *made) {
    form_factors_free(&made->f);
    block_factors_free(&made->blocks);
    lam_operator_close(made->op);
    group_errors_free(&made->by_group);
    *made = (trial_made){.op = NULL};
}

/* Puts the operator of the trial that just ended aside. */
static void set_aside(precompute_state *state, double excess) {
    trial_made_free(&state->trial.best);
    state->trial.best = (trial_made){.op = state->op,
                                     .built = state->built,
                                     .errors = state->errors,
                                     .by_group = state->by_group,
                                     .epsilon = state->trial.epsilon,
                                     .excess = excess};
    state->op = NULL;
    state->by_group = (group_errors){.n_groups = 0};
}

/* Makes room for other form factors. The operator put aside keeps those that it was built from, their rows
 * only where the store keeps them. */
static void release_factors(precompute_state *state) {
    trial_made *best = &state->trial.best;
    if (!state_keeps(state->options)) {
        csr_free(&state->f.F);
        block_factors_free(&state->blocks);
    }
    if (best->f.row_sums == NULL) {
        best->f = state->f;
        best->blocks = state->blocks;
    } else {
        form_factors_free(&state->f);
        block_factors_free(&state->blocks);
    }
    state->f = (form_factors){.row_sums = NULL};
    state->blocks = (block_factors){.n = 0};
}

void state_take_back(precompute_state *state) {
    trial_made *best = &state->trial.best;
    lam_operator_close(state->op);
    state->op = best->op;
    state->built = best->built;
    state->errors = best->errors;
    group_errors_free(&state->by_group);
    state->by_group = best->by_group;
    best->by_group = (group_errors){.n_groups = 0};
    state->trial.epsilon = best->epsilon;
    best->op = NULL;
    if (best->f.row_sums == NULL) return;
    form_factors_free(&state->f);
    block_factors_free(&state->blocks);
    state->f = best->f;
    state->blocks = best->blocks;
    best->f = (form_factors){.row_sums = NULL};
    best->blocks = (block_factors){.n = 0};
}

static bool is_judged_keeper(const precompute_state *state) {
    return state->probes > 0 && (method_find(state->built.method)->flags & METHOD_KEEPS_EPSILON) != 0;
}

bool state_keeps_epsilon(const precompute_state *state) {
    return state->trial.asked > 0 && is_judged_keeper(state);
}

static bool keeps_group_error(const precompute_state *state) {
    return state->trial.group > 0 && state->probes > 0;
}

/* Without --epsilon and --group-error the error that calls for a warning is kept where a finer threshold can
 * do it for next to nothing: an operator costs a small part of form factors pair by pair. */
static bool keeps_preset(const precompute_state *state) {
    return state->trial.asked == 0 && !keeps_group_error(state) && is_judged_keeper(state) &&
           recipe_can(&state->f.recipe, SOURCE_TWICE);
}

/* The error of the lights, or of random emission, to keep; 0: none. */
static double asked_of(const precompute_state *state) {
    if (state_keeps_epsilon(state)) return state->trial.asked;
    return keeps_preset(state) ? error_advice_most : 0;
}

/* The goal of which most is lacking; *group: it is that of --group-error. */
static trial_goal goal_of(const precompute_state *state, bool *group) {
    const bool by_noise = state->built.by_noise;
    const worst_group worst = judge_worst_group(&state->by_group);
    const trial_goal of_group = trial_goal_of_group(state->trial.group, &worst, by_noise);
    const trial_goal of_epsilon = {.asked = asked_of(state),
                                   .errors = trial_errors_of(trial_group(&state->errors), by_noise)};
    *group = keeps_group_error(state) &&
             (!state_keeps_epsilon(state) || trial_excess(&of_group) > trial_excess(&of_epsilon));
    return *group ? of_group : of_epsilon;
}

/* Bytes of the next trial, beside the operator, and where they are kept the form factors, of this one. */
static double bytes_of(precompute_state *state, const trial_knobs *next) {
    const recipe before = state->recipe;
    const bool streamed = state->streamed, again = recipes_differ(&before, &next->recipe);
    build_options how = state_build_options(state);
    lam_error none;
    double beside = (double)lam_operator_bytes(state->op);
    if (again && state_keeps(state->options))
        beside += recipe_source(&before)->bytes((double)state->m.n, &before);
    (void)build_set_number(&how, "epsilon", next->epsilon, &none); /* below one that is in its limits */
    state->recipe = next->recipe;
    state->streamed = streamed && again; /* else the judge's rows are there */
    forecast f = state_forecast(state, (double)state->m.n);
    state->recipe = before;
    state->streamed = streamed;
    f.build = &how;
    f.cost = (factor_cost){.seconds = 0};
    return forecast_bytes(&f) + beside;
}

/* Takes turns back until memory suffices: rays are halved, blocks made coarser; false where none is left. */
static bool fit(precompute_state *state, const trial_knobs *from, trial_knobs *next) {
    while (bytes_of(state, next) > state->memory) {
        recipe *r = &next->recipe;
        state->trial.lacking = bytes_of(state, next);
        if (!recipes_differ(&from->recipe, r)) return false;
        r->rays = r->rays / 2 > from->recipe.rays ? r->rays / 2 : from->recipe.rays;
        r->accuracy = r->accuracy * 2 < from->recipe.accuracy ? r->accuracy * 2 : from->recipe.accuracy;
    }
    return next->epsilon != from->epsilon || recipes_differ(&from->recipe, &next->recipe);
}

bool state_follows_epsilon(const precompute_state *state) {
    const build_method *m = method_find(state->built.method);
    const build_options *o = &state->options->build;
    return method_has_option(m, "epsilon") &&
           (m->ignores == NULL || !m->ignores(method_own_const(o, m), &state->built, "epsilon"));
}

/* Rows of a store are as they are, and those of a scratch folder are kept for a run that goes on. */
static trial_limits limits_of(const precompute_state *state) {
    const precompute_options *o = state->options;
    const bool made = !o->from_store && o->scratch == NULL && !state->trial.spent && !keeps_preset(state);
    return (trial_limits){.rays = made && o->rays == OPTION_AUTO,
                          .accuracy = made,
                          .fixed_epsilon = !state_follows_epsilon(state),
                          .finest = state_finest_accuracy()};
}

/* Finer form factors are no use where they left more than this share of their part of the error: a finer
 * bound changes nothing where blocks are single pairs of elements. */
static const double spent_share = .9;

/* The worst of many groups is another one as soon as it is better, so that it follows no law closely. The
 * last trial, after which nothing can be mended, aims lower: with receivers .9 stopped at .051 for .05. */
static const double last_share = .6;

/* The knobs of the next trial; false: there is none, as nothing can be turned. */
static bool turn(precompute_state *state, const trial_knobs *from, trial_knobs *next) {
    bool group;
    const trial_goal goal = goal_of(state, &group);
    const bool same = group == state->trial.group_missed && state->trial.missed.asked > 0;
    state->trial.spent =
        state->trial.spent || (state->trial.factors > 0 && same &&
                               goal.errors.factors / goal.asked > spent_share * state->trial.factors);
    trial_limits limits = limits_of(state);
    if (same && group)
        limits.power = trial_power(from->epsilon, goal.errors.compression, state->trial.before.epsilon,
                                   state->trial.missed.errors.compression);
    if (group && state->trial.count + 1 == state->options->trials) limits.aimed_share = last_share;
    state->trial.factors = 0;
    state->trial.lacking = 0;
    if (!trial_turn(goal.asked, &goal.errors, &limits, from, next)) return false;
    if (fit(state, from, next)) return true;
    limits.rays = limits.accuracy = false;
    return trial_turn(goal.asked, &goal.errors, &limits, from, next) && fit(state, from, next);
}

static bool keeps_any(const precompute_state *state) {
    return asked_of(state) > 0 || keeps_group_error(state);
}

bool state_may_try_again(const precompute_state *state) {
    return keeps_any(state) && state->trial.count + 1 < state->options->trials;
}

/* The form factors of the judge stay where those of the operator do, and all of its references where memory
 * has room for them beside the next operator. */
static void release_references(precompute_state *state, const trial_knobs *next, bool same) {
    judge_references **r = &state->trial.references;
    if (!same) judge_references_free_samples(*r);
    if (bytes_of(state, next) + judge_references_bytes(*r) <= state->memory) return;
    judge_references_free(*r);
    *r = NULL;
}

/* Says what the trial has, and what is turned next. */
static void log_trial(const precompute_state *state, const trial_goal *goal, bool group, const char *knobs) {
    const error_group *g = trial_group(&state->errors);
    const worst_group worst = judge_worst_group(&state->by_group);
    const char *next = knobs[0] != '\0' ? "; next: " : "";
    char what[TRIAL_WORST_TEXT];
    if (!group) {
        terminal_log(
            state->t, "trial %zu: the indirect error of %s is stated as %.2g, %s %g%s%s", state->trial.count,
            g == &state->errors.lights ? "the scene's own lights" : "random emission", goal->errors.total,
            state_keeps_epsilon(state)         ? "--epsilon asks for"
            : goal->errors.total > goal->asked ? "above"
                                               : "at most",
            goal->asked, next, knobs);
        return;
    }
    if (worst.group == state->by_group.n_groups) {
        terminal_log(state->t, "trial %zu: no group has reflected light, --group-error has nothing to keep",
                     state->trial.count);
        return;
    }
    trial_describe_worst(&worst, state->m.group_names[worst.group], what);
    terminal_log(state->t, "trial %zu: the error of %s is stated as %.2g, --group-error asks for %g%s%s",
                 state->trial.count, what, goal->errors.total, goal->asked, next, knobs);
}

bool state_next_trial(precompute_state *state) {
    trial_course *all = &state->trial;
    const trial_knobs from = {.epsilon = all->epsilon, .recipe = state->recipe};
    trial_knobs next = from;
    char knobs[TRIAL_TEXT] = "";
    bool group;
    const trial_goal goal = goal_of(state, &group);
    const double excess = trial_excess(&goal);
    if (!keeps_any(state)) return false;
    all->count++;
    const bool better = all->best.op == NULL || excess < all->best.excess;
    const bool again = excess > 1 && all->count < state->options->trials && turn(state, &from, &next);
    if (!again && all->count == 1 && keeps_preset(state)) {
        all->count = 0; /* nobody asked for a trial */
        return false;
    }
    if (again) trial_describe(&from, &next, knobs);
    log_trial(state, &goal, group, knobs);
    if (!again) {
        if (!better) state_take_back(state);
        return false;
    }
    release_references(state, &next, !recipes_differ(&from.recipe, &next.recipe));
    if (better) set_aside(state, excess);
    lam_operator_close(state->op);
    state->op = NULL;
    if (recipes_differ(&from.recipe, &next.recipe)) {
        all->factors = goal.errors.factors / goal.asked;
        release_factors(state);
    } else {
        state->streamed = false; /* the rows are there, as the judge needed them */
    }
    all->before = from;
    all->missed = goal;
    all->group_missed = group;
    state->recipe = next.recipe;
    all->epsilon = next.epsilon;
    return true;
}

void state_report_trials(precompute_state *state) {
    trial_course *all = &state->trial;
    judge_references_free(all->references);
    all->references = NULL;
    if (all->count == 0) return;
    if (state_keeps_epsilon(state)) {
        report_number(&state->built, "epsilon", all->asked);
        report_number(&state->built, "epsilon_stated", judge_total(trial_group(&state->errors)));
    }
    if (keeps_group_error(state)) {
        report_number(&state->built, "group_error", all->group);
        report_number(&state->built, "group_error_stated", judge_worst_group(&state->by_group).total);
    }
    report_count(&state->built, "trials", (double)all->count);
}
