/* The trials of --epsilon and --group-error: which operator and form factors stay, and when they end.
 * Operators and form factors are real, errors are made up. */
#include "solver/base/terminal.h"
#include "solver/formfactor/source.h"
#include "solver/precompute/stages.h"
#include "support/scene.h"
#include "support/suite.h"

#include <math.h>
#include <stdlib.h>

static const double asked = .01;

static void begin(precompute_options *options, terminal *t, precompute_parts *parts) {
    const generate_options how = {.kind = "box", .size = {1, 1, 1}, .divisions = 2, .reflectance = .5};
    lam_error error = {.message = ""};
    *options = (precompute_options){.form_factors = source_place(&source_rays),
                                    .quality = QUALITY_DRAFT,
                                    .rays = OPTION_AUTO,
                                    .probes = 1,
                                    .trials = TRIALS_MOST,
                                    .build = build_presets("hierarchical")};
    terminal_open(t, "test", true, false);
    *parts = parts_begin(options, t);
    parts->job.memory = 1e12;
    parts->plan.probes = 1;
    parts->plan.method = method_find("hierarchical");
    parts->plan.recipe = (recipe){.source = &source_rays, .rays = 256, .seed = 1};
    parts->job.kept_epsilon = asked;
    parts->scene.m = generate_good(&how);
    parts->scene.order = memory_allocate(parts->scene.m.n, sizeof *parts->scene.order, "order", &error);
    ck_assert_ptr_nonnull(parts->scene.order);
    ck_ok(mesh_z_order(&parts->scene.m, parts->scene.order, &error));
}

static bool next_trial(precompute_parts *p) {
    return stage_next_trial(&p->job, &p->scene, &p->plan, &p->factors, &p->made, &p->course);
}

static bool may_be_repeated(const precompute_parts *p) {
    const finished_trial now = parts_view(p);
    return trial_may_be_repeated(&now);
}

static void report(precompute_parts *p) {
    const finished_trial now = parts_view(p);
    trial_report(&now, &p->made.built);
}

/* Form factors, unless they are there, and operator, whose stated errors are these. */
static void make(precompute_parts *parts, double total, double compression) {
    lam_error error = {.message = ""};
    if (parts->factors.f.row_sums == NULL)
        ck_ok(stage_factors(&parts->job, &parts->scene, &parts->plan, &parts->factors, &error));
    ck_assert_ptr_null(parts->made.op);
    ck_ok(stage_operator(&parts->job, &parts->scene, &parts->plan, &parts->factors, &parts->made,
                         &parts->course, &error));
    parts->made.built.by_noise = false;
    parts->made.errors = (error_report){.random = {.probes = 8,
                                                   .total_indirect = {total, 0, total},
                                                   .operator_indirect = {compression, 0, compression}},
                                        .has_total = true};
}

START_TEST(an_error_that_is_kept_ends_it) {
    precompute_options options;
    terminal t;
    precompute_parts parts;
    begin(&options, &t, &parts);
    make(&parts, .01, .001);
    ck_assert(!next_trial(&parts));
    ck_assert_uint_eq(parts.course.count, 1);
    report(&parts);
    ck_assert_double_eq(report_get(&parts.made.built, "epsilon", 0), .01);
    ck_assert_double_eq(report_get(&parts.made.built, "epsilon_stated", 0), .01);
    ck_assert_double_eq(report_get(&parts.made.built, "trials", 0), 1);
    parts_free(&parts);
}
END_TEST

/* More rays made it worse: the first operator is back, and the row sums and the recipe of its form factors.
 */
START_TEST(the_best_comes_back) {
    precompute_options options;
    terminal t;
    precompute_parts parts;
    const bool keeps = _i == 1;
    begin(&options, &t, &parts);
    if (keeps) options.keep_form_factors = "";
    make(&parts, .02, .001);
    const lam_operator *best = parts.made.op;
    const double *sums = parts.factors.f.row_sums, epsilon = parts.course.epsilon;
    ck_assert(next_trial(&parts));
    ck_assert_uint_gt(parts.plan.recipe.rays, 256);
    ck_assert_ptr_null(parts.factors.f.row_sums);
    make(&parts, .05, .04); /* the threshold is turned next, of the same form factors */
    ck_assert(next_trial(&parts));
    ck_assert_double_lt(parts.course.epsilon, epsilon);
    ck_assert_ptr_nonnull(parts.factors.f.row_sums);
    ck_assert_uint_gt(parts.factors.f.recipe.rays, 256);
    make(&parts, .03, .029);
    ck_assert(!next_trial(&parts)); /* three trials at most */
    ck_assert_ptr_eq(parts.made.op, best);
    ck_assert_ptr_eq(parts.factors.f.row_sums, sums);
    ck_assert_uint_eq(parts.factors.f.recipe.rays, 256);
    ck_assert_double_eq(parts.made.errors.random.total_indirect.mean, .02);
    ck_assert_double_eq(parts.course.epsilon, epsilon);
    ck_assert_int_eq(parts.factors.f.F.indptr != NULL, keeps);
    report(&parts);
    ck_assert_double_eq(report_get(&parts.made.built, "trials", 0), 3);
    ck_assert_double_eq(report_get(&parts.made.built, "epsilon_stated", 0), .02);
    parts_free(&parts);
}
END_TEST

/* The threshold alone: form factors stay, and the last trial if it is the best. */
START_TEST(form_factors_are_used_again) {
    precompute_options options;
    terminal t;
    precompute_parts parts;
    begin(&options, &t, &parts);
    make(&parts, .02, .0199);
    const double *sums = parts.factors.f.row_sums;
    ck_assert(next_trial(&parts));
    ck_assert_ptr_eq(parts.factors.f.row_sums, sums);
    make(&parts, .015, .0149);
    const lam_operator *last = parts.made.op;
    options.from_store = true;
    parts.made.errors.random.operator_indirect.mean =
        0; /* now all is left to form factors, which are those of a store */
    ck_assert(!next_trial(&parts));
    ck_assert_ptr_eq(parts.made.op, last);
    ck_assert_double_eq(parts.made.errors.random.total_indirect.mean, .015);
    parts_free(&parts);
}
END_TEST

/* Finer form factors that leave their error as it was are not made finer again. */
START_TEST(a_knob_without_effect_is_left) {
    precompute_options options;
    terminal t;
    precompute_parts parts;
    begin(&options, &t, &parts);
    make(&parts, .02, .001);
    ck_assert(next_trial(&parts));
    make(&parts, .0195, .001);
    const size_t rays = parts.plan.recipe.rays;
    ck_assert(!next_trial(&parts));
    ck_assert(parts.course.spent);
    ck_assert_uint_eq(parts.plan.recipe.rays, rays);
    parts_free(&parts);
}
END_TEST

/* Memory has no room for more rays: their number stays, and the bytes that are lacking are known. */
START_TEST(memory_is_a_limit) {
    precompute_options options;
    terminal t;
    precompute_parts parts;
    begin(&options, &t, &parts);
    make(&parts, .02, .001);
    parts.job.memory = 1;
    ck_assert(!next_trial(&parts));
    ck_assert_uint_eq(parts.plan.recipe.rays, 256);
    ck_assert_double_gt(parts.course.lacking, 1);
    parts_free(&parts);
}
END_TEST

/* Nobody asked for an error: of form factors pair by pair the threshold alone is turned until the error calls
 * for no warning. */
START_TEST(the_preset_is_kept_by_the_threshold) {
    precompute_options options;
    terminal t;
    precompute_parts parts;
    begin(&options, &t, &parts);
    parts.job.kept_epsilon = 0;
    parts.plan.recipe = (recipe){.source = &source_pairs, .rays = 256, .accuracy = 1e-4, .seed = 1};
    const recipe pairs = parts.plan.recipe;
    make(&parts, .04, .039);
    const double epsilon = parts.course.epsilon, *sums = parts.factors.f.row_sums;
    ck_assert(may_be_repeated(&parts));
    ck_assert(next_trial(&parts));
    ck_assert_double_eq_tol(parts.course.epsilon,
                            epsilon * pow(sqrt(.027 * .027 - (.04 * .04 - .039 * .039)) / .039, 1 / .6),
                            1e-9);
    ck_assert(!recipes_differ(&parts.plan.recipe, &pairs));
    ck_assert_ptr_eq(parts.factors.f.row_sums, sums);
    make(&parts, .02, .01);
    ck_assert(!next_trial(&parts));
    report(&parts);
    ck_assert_double_eq(report_get(&parts.made.built, "trials", 0), 2);
    ck_assert_double_eq(report_get(&parts.made.built, "epsilon_stated", -1), -1);
    parts_free(&parts);
}
END_TEST

/* It needs no trial, or the form factors would have to be finer, or they are of rays, whose noise the
 * threshold follows. */
START_TEST(the_preset_has_no_other_trials) {
    static const double errors[][2] = {{.03, .029}, {.04, .001}, {.04, .039}};
    precompute_options options;
    terminal t;
    precompute_parts parts;
    begin(&options, &t, &parts);
    parts.job.kept_epsilon = 0;
    if (_i < 2)
        parts.plan.recipe = (recipe){.source = &source_pairs, .rays = 256, .accuracy = 1e-4, .seed = 1};
    make(&parts, errors[_i][0], errors[_i][1]);
    ck_assert_int_eq(may_be_repeated(&parts), _i < 2);
    ck_assert(!next_trial(&parts));
    ck_assert_uint_eq(parts.course.count, 0);
    report(&parts);
    ck_assert_double_eq(report_get(&parts.made.built, "trials", 0), 0);
    parts_free(&parts);
}
END_TEST

/* Errors of the only group, by light from far away. */
static void set_group_error(precompute_parts *parts, double total, double of_operator) {
    group_errors *e = &parts->made.by_group;
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
    precompute_parts parts;
    begin(&options, &t, &parts);
    options.group_error = .1;
    make(&parts, .015, .001);
    set_group_error(&parts, .4, .4);
    const double first = parts.course.epsilon;
    const size_t rays = parts.plan.recipe.rays;
    ck_assert(next_trial(&parts));
    ck_assert_uint_eq(parts.plan.recipe.rays, rays);
    const double second = parts.course.epsilon;
    ck_assert_double_eq_tol(second, first * pow(.09 / .4, 1 / .6), 1e-12);
    make(&parts, .009, .001);
    set_group_error(&parts, .3, .3);
    ck_assert(next_trial(&parts));
    const double power = log(.3 / .4) / log(second / first);
    const double factor = fmax(pow(.09 / .3, 1 / power), 1. / 64);
    ck_assert_double_eq_tol(parts.course.epsilon, second * factor, 1e-9 * second);
    make(&parts, .02, .001); /* --epsilon by 2, as much as the best of before lacked */
    set_group_error(&parts, .05, .05);
    const lam_operator *last = parts.made.op;
    ck_assert(!next_trial(&parts));
    ck_assert_ptr_eq(parts.made.op, last);
    report(&parts);
    ck_assert_double_eq(report_get(&parts.made.built, "group_error", 0), .1);
    ck_assert_double_eq(report_get(&parts.made.built, "group_error_stated", 0), .05);
    ck_assert_double_eq(report_get(&parts.made.built, "epsilon_stated", 0), .02);
    ck_assert_double_eq(report_get(&parts.made.built, "trials", 0), 3);
    parts_free(&parts);
}
END_TEST

/* A kind that does not keep epsilon gets finer form factors, as long as these are what the group lacks. */
START_TEST(other_kinds_keep_groups_by_form_factors) {
    precompute_options options;
    terminal t;
    precompute_parts parts;
    begin(&options, &t, &parts);
    options.build = build_presets("exact");
    parts.job.kept_epsilon = 0;
    options.group_error = .1;
    make(&parts, .02, .001);
    set_group_error(&parts, .2, .01);
    ck_assert(next_trial(&parts));
    ck_assert_uint_gt(parts.plan.recipe.rays, 256);
    make(&parts, .02, .001);
    set_group_error(&parts, .2, .2);
    parts.course.spent = false;
    const double epsilon = parts.course.epsilon;
    ck_assert(!next_trial(&parts));
    ck_assert_double_eq(parts.course.epsilon, epsilon);
    report(&parts);
    ck_assert_double_eq(report_get(&parts.made.built, "epsilon_stated", -1), -1);
    parts_free(&parts);
}
END_TEST

START_TEST(a_group_that_is_not_measured_ends_it) {
    precompute_options options;
    terminal t;
    precompute_parts parts;
    begin(&options, &t, &parts);
    parts.job.kept_epsilon = 0;
    options.group_error = .1;
    make(&parts, .02, .001);
    ck_assert(!next_trial(&parts));
    ck_assert_uint_eq(parts.course.count, 1);
    parts_free(&parts);
}
END_TEST

START_TEST(nothing_is_tried_where_nothing_was_asked_or_measured) {
    for (int k = 0; k < 3; k++) {
        precompute_options options;
        terminal t;
        precompute_parts parts;
        begin(&options, &t, &parts);
        make(&parts, .02, .001);
        if (k == 0) parts.job.kept_epsilon = 0;
        if (k == 1) parts.plan.probes = 0;
        if (k == 2) parts.made.built.method = "exact";
        ck_assert(!next_trial(&parts));
        ck_assert_uint_eq(parts.course.count, 0);
        parts_free(&parts);
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
