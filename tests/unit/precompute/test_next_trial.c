/* The trials of --epsilon and --group-error: which operator and form factors stay, and when they end.
 * Operators and form factors are real, errors are made up. */
#include "solver/base/terminal.h"
#include "solver/formfactor/source.h"
#include "solver/precompute/precompute_state.h"
#include "support/scene.h"
#include "support/suite.h"

#include <math.h>
#include <stdlib.h>

static const double asked = .01;

static void begin(precompute_options *options, terminal *t, precompute_state *state) {
    const generate_options how = {.kind = "box", .size = {1, 1, 1}, .divisions = 2, .reflectance = .5};
    lam_error error = {.message = ""};
    *options = (precompute_options){.form_factors = FACTORS_RAYS,
                                    .quality = QUALITY_DRAFT,
                                    .rays = OPTION_AUTO,
                                    .probes = 1,
                                    .trials = TRIALS_MOST,
                                    .build = build_presets("hierarchical")};
    terminal_open(t, "test", true, false);
    *state = state_begin(options, t);
    state->memory = 1e12;
    state->probes = 1;
    state->expected = method_find("hierarchical");
    state->recipe = (recipe){.source = &source_rays, .rays = 256, .seed = 1};
    state->trial.asked = asked;
    state->m = generate_good(&how);
    state->order = memory_allocate(state->m.n, sizeof *state->order, "order", &error);
    ck_assert_ptr_nonnull(state->order);
    ck_ok(mesh_z_order(&state->m, state->order, &error));
}

/* Form factors, unless they are there, and operator, whose stated errors are these. */
static void make(precompute_state *state, double total, double compression) {
    lam_error error = {.message = ""};
    if (state->f.row_sums == NULL) ck_ok(stage_form_factors(state, &error));
    ck_assert_ptr_null(state->op);
    ck_ok(stage_operator(state, &error));
    state->built.by_noise = false;
    state->errors = (error_report){.random = {.probes = 8,
                                              .total_indirect = {total, 0, total},
                                              .operator_indirect = {compression, 0, compression}},
                                   .has_total = true};
}

START_TEST(an_error_that_is_kept_ends_it) {
    precompute_options options;
    terminal t;
    precompute_state state;
    begin(&options, &t, &state);
    make(&state, .01, .001);
    ck_assert(!state_next_trial(&state));
    ck_assert_uint_eq(state.trial.count, 1);
    state_report_trials(&state);
    ck_assert_double_eq(report_get(&state.built, "epsilon", 0), .01);
    ck_assert_double_eq(report_get(&state.built, "epsilon_stated", 0), .01);
    ck_assert_double_eq(report_get(&state.built, "trials", 0), 1);
    state_free(&state);
}
END_TEST

/* More rays made it worse: the first operator is back, and the row sums and the recipe of its form factors.
 */
START_TEST(the_best_comes_back) {
    precompute_options options;
    terminal t;
    precompute_state state;
    const bool keeps = _i == 1;
    begin(&options, &t, &state);
    if (keeps) options.keep_form_factors = "";
    make(&state, .02, .001);
    const lam_operator *best = state.op;
    const double *sums = state.f.row_sums, epsilon = state.trial.epsilon;
    ck_assert(state_next_trial(&state));
    ck_assert_uint_gt(state.recipe.rays, 256);
    ck_assert_ptr_null(state.f.row_sums);
    make(&state, .05, .04); /* the threshold is turned next, of the same form factors */
    ck_assert(state_next_trial(&state));
    ck_assert_double_lt(state.trial.epsilon, epsilon);
    ck_assert_ptr_nonnull(state.f.row_sums);
    ck_assert_uint_gt(state.f.recipe.rays, 256);
    make(&state, .03, .029);
    ck_assert(!state_next_trial(&state)); /* three trials at most */
    ck_assert_ptr_eq(state.op, best);
    ck_assert_ptr_eq(state.f.row_sums, sums);
    ck_assert_uint_eq(state.f.recipe.rays, 256);
    ck_assert_double_eq(state.errors.random.total_indirect.mean, .02);
    ck_assert_double_eq(state.trial.epsilon, epsilon);
    ck_assert_int_eq(state.f.F.indptr != NULL, keeps);
    state_report_trials(&state);
    ck_assert_double_eq(report_get(&state.built, "trials", 0), 3);
    ck_assert_double_eq(report_get(&state.built, "epsilon_stated", 0), .02);
    state_free(&state);
}
END_TEST

/* The threshold alone: form factors stay, and the last trial if it is the best. */
START_TEST(form_factors_are_used_again) {
    precompute_options options;
    terminal t;
    precompute_state state;
    begin(&options, &t, &state);
    make(&state, .02, .0199);
    const double *sums = state.f.row_sums;
    ck_assert(state_next_trial(&state));
    ck_assert_ptr_eq(state.f.row_sums, sums);
    make(&state, .015, .0149);
    const lam_operator *last = state.op;
    options.from_store = true;
    state.errors.random.operator_indirect.mean =
        0; /* now all is left to form factors, which are those of a store */
    ck_assert(!state_next_trial(&state));
    ck_assert_ptr_eq(state.op, last);
    ck_assert_double_eq(state.errors.random.total_indirect.mean, .015);
    state_free(&state);
}
END_TEST

/* Finer form factors that leave their error as it was are not made finer again. */
START_TEST(a_knob_without_effect_is_left) {
    precompute_options options;
    terminal t;
    precompute_state state;
    begin(&options, &t, &state);
    make(&state, .02, .001);
    ck_assert(state_next_trial(&state));
    make(&state, .0195, .001);
    const size_t rays = state.recipe.rays;
    ck_assert(!state_next_trial(&state));
    ck_assert(state.trial.spent);
    ck_assert_uint_eq(state.recipe.rays, rays);
    state_free(&state);
}
END_TEST

/* Memory has no room for more rays: their number stays, and the bytes that are lacking are known. */
START_TEST(memory_is_a_limit) {
    precompute_options options;
    terminal t;
    precompute_state state;
    begin(&options, &t, &state);
    make(&state, .02, .001);
    state.memory = 1;
    ck_assert(!state_next_trial(&state));
    ck_assert_uint_eq(state.recipe.rays, 256);
    ck_assert_double_gt(state.trial.lacking, 1);
    state_free(&state);
}
END_TEST

/* Nobody asked for an error: of form factors pair by pair the threshold alone is turned until the error calls
 * for no warning. */
START_TEST(the_preset_is_kept_by_the_threshold) {
    precompute_options options;
    terminal t;
    precompute_state state;
    begin(&options, &t, &state);
    state.trial.asked = 0;
    state.recipe = (recipe){.source = &source_pairs, .rays = 256, .accuracy = 1e-4, .seed = 1};
    const recipe pairs = state.recipe;
    make(&state, .04, .039);
    const double epsilon = state.trial.epsilon, *sums = state.f.row_sums;
    ck_assert(state_may_try_again(&state));
    ck_assert(state_next_trial(&state));
    ck_assert_double_eq_tol(state.trial.epsilon,
                            epsilon * pow(sqrt(.027 * .027 - (.04 * .04 - .039 * .039)) / .039, 1 / .6),
                            1e-9);
    ck_assert(!recipes_differ(&state.recipe, &pairs));
    ck_assert_ptr_eq(state.f.row_sums, sums);
    make(&state, .02, .01);
    ck_assert(!state_next_trial(&state));
    state_report_trials(&state);
    ck_assert_double_eq(report_get(&state.built, "trials", 0), 2);
    ck_assert_double_eq(report_get(&state.built, "epsilon_stated", -1), -1);
    state_free(&state);
}
END_TEST

/* It needs no trial, or the form factors would have to be finer, or they are of rays, whose noise the
 * threshold follows. */
START_TEST(the_preset_has_no_other_trials) {
    static const double errors[][2] = {{.03, .029}, {.04, .001}, {.04, .039}};
    precompute_options options;
    terminal t;
    precompute_state state;
    begin(&options, &t, &state);
    state.trial.asked = 0;
    if (_i < 2) state.recipe = (recipe){.source = &source_pairs, .rays = 256, .accuracy = 1e-4, .seed = 1};
    make(&state, errors[_i][0], errors[_i][1]);
    ck_assert_int_eq(state_may_try_again(&state), _i < 2);
    ck_assert(!state_next_trial(&state));
    ck_assert_uint_eq(state.trial.count, 0);
    state_report_trials(&state);
    ck_assert_double_eq(report_get(&state.built, "trials", 0), 0);
    state_free(&state);
}
END_TEST

/* Errors of the only group, by light from far away. */
static void set_group_error(precompute_state *state, double total, double of_operator) {
    group_errors *e = &state->by_group;
    group_errors_free(e);
    *e = (group_errors){.n_groups = 1, .n_rows = 1};
    for (int f = 0; f < GROUP_FIGURES; f++) {
        e->of[f] = memory_allocate(1, sizeof **e->of, "errors", NULL);
        e->of_operator[f] = memory_allocate(1, sizeof **e->of_operator, "errors", NULL);
        ck_assert(e->of[f] != NULL && e->of_operator[f] != NULL);
    }
    e->of[GROUP_UNIFORM][0] = total / 4;
    e->of[GROUP_NEAR][0] = NAN;
    e->of[GROUP_FAR][0] = total;
    e->of_operator[GROUP_FAR][0] = of_operator;
}

/* The error of the group is the one that most is lacking of; the law of its compression is measured. */
START_TEST(the_worst_group_is_kept) {
    precompute_options options;
    terminal t;
    precompute_state state;
    begin(&options, &t, &state);
    state.trial.group = .1;
    make(&state, .015, .001);
    set_group_error(&state, .4, .4);
    const double first = state.trial.epsilon;
    const size_t rays = state.recipe.rays;
    ck_assert(state_next_trial(&state));
    ck_assert_uint_eq(state.recipe.rays, rays);
    const double second = state.trial.epsilon;
    ck_assert_double_eq_tol(second, first * pow(.09 / .4, 1 / .6), 1e-12);
    make(&state, .009, .001);
    set_group_error(&state, .3, .3);
    ck_assert(state_next_trial(&state));
    const double power = log(.3 / .4) / log(second / first);
    const double factor = fmax(pow(.09 / .3, 1 / power), 1. / 64);
    ck_assert_double_eq_tol(state.trial.epsilon, second * factor, 1e-9 * second);
    make(&state, .02, .001); /* --epsilon by 2, as much as the best of before lacked */
    set_group_error(&state, .05, .05);
    const lam_operator *last = state.op;
    ck_assert(!state_next_trial(&state));
    ck_assert_ptr_eq(state.op, last);
    state_report_trials(&state);
    ck_assert_double_eq(report_get(&state.built, "group_error", 0), .1);
    ck_assert_double_eq(report_get(&state.built, "group_error_stated", 0), .05);
    ck_assert_double_eq(report_get(&state.built, "epsilon_stated", 0), .02);
    ck_assert_double_eq(report_get(&state.built, "trials", 0), 3);
    state_free(&state);
}
END_TEST

/* A kind that does not keep epsilon gets finer form factors, as long as these are what the group lacks. */
START_TEST(other_kinds_keep_groups_by_form_factors) {
    precompute_options options;
    terminal t;
    precompute_state state;
    begin(&options, &t, &state);
    options.build = build_presets("exact");
    state.trial.asked = 0;
    state.trial.group = .1;
    make(&state, .02, .001);
    set_group_error(&state, .2, .01);
    ck_assert(state_next_trial(&state));
    ck_assert_uint_gt(state.recipe.rays, 256);
    make(&state, .02, .001);
    set_group_error(&state, .2, .2);
    state.trial.spent = false;
    const double epsilon = state.trial.epsilon;
    ck_assert(!state_next_trial(&state));
    ck_assert_double_eq(state.trial.epsilon, epsilon);
    state_report_trials(&state);
    ck_assert_double_eq(report_get(&state.built, "epsilon_stated", -1), -1);
    state_free(&state);
}
END_TEST

START_TEST(a_group_that_is_not_measured_ends_it) {
    precompute_options options;
    terminal t;
    precompute_state state;
    begin(&options, &t, &state);
    state.trial.asked = 0;
    state.trial.group = .1;
    make(&state, .02, .001);
    ck_assert(!state_next_trial(&state));
    ck_assert_uint_eq(state.trial.count, 1);
    state_free(&state);
}
END_TEST

START_TEST(nothing_is_tried_where_nothing_was_asked_or_measured) {
    for (int k = 0; k < 3; k++) {
        precompute_options options;
        terminal t;
        precompute_state state;
        begin(&options, &t, &state);
        make(&state, .02, .001);
        if (k == 0) state.trial.asked = 0;
        if (k == 1) state.probes = 0;
        if (k == 2) state.built.method = "exact";
        ck_assert(!state_next_trial(&state));
        ck_assert_uint_eq(state.trial.count, 0);
        state_free(&state);
    }
}
END_TEST

int main(void) {
    Suite *suite = suite_create("next trial");
    TCase *cases = tcase_create("next trial");
    tcase_set_timeout(cases, 120);
    tcase_add_test(cases, an_error_that_is_kept_ends_it);
    tcase_add_loop_test(cases, the_best_comes_back, 0, 2);
    tcase_add_test(cases, form_factors_are_used_again);
    tcase_add_test(cases, a_knob_without_effect_is_left);
    tcase_add_test(cases, memory_is_a_limit);
    tcase_add_test(cases, the_preset_is_kept_by_the_threshold);
    tcase_add_loop_test(cases, the_preset_has_no_other_trials, 0, 3);
    tcase_add_test(cases, the_worst_group_is_kept);
    tcase_add_test(cases, other_kinds_keep_groups_by_form_factors);
    tcase_add_test(cases, a_group_that_is_not_measured_ends_it);
    tcase_add_test(cases, nothing_is_tried_where_nothing_was_asked_or_measured);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
