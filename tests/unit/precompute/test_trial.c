/* The knobs of --epsilon: which is turned after a trial, and by how much. */
#include "solver/formfactor/source.h"
#include "solver/precompute/trial.h"
#include "support/suite.h"

#include <math.h>
#include <string.h>

static const trial_limits free_knobs = {.rays = true, .accuracy = true, .finest = 7e-6};
static const trial_knobs of_rays = {.epsilon = .01, .recipe = {.source = &source_rays, .rays = 512}},
                         of_near = {.epsilon = .01, .recipe = {.source = &source_near_pairs, .rays = 512}},
                         of_pairs = {.epsilon = .01,
                                     .recipe = {.source = &source_pairs, .rays = 256, .accuracy = 7e-5}},
                         of_blocks = {.epsilon = .01,
                                      .recipe = {.source = &source_blocks, .rays = 8, .accuracy = 8e-5}};

static trial_errors parts(double compression, double factors) {
    return (trial_errors){
        .total = hypot(compression, factors), .compression = compression, .factors = factors};
}

START_TEST(parts_add_in_squares) {
    const error_group g = {.total_indirect = {.05, 0, .05}, .operator_indirect = {.03, 0, .03}},
                      noisy = {.total_indirect = {.03, 0, .03}, .operator_indirect = {.05, 0, .05}};
    ck_assert_double_eq_tol(trial_errors_of(&g, false).factors, .04, 1e-15);
    ck_assert_double_eq(trial_errors_of(&noisy, true).factors, 0);
    ck_assert(trial_errors_of(&noisy, true).by_noise);
    error_report both = {.lights = {.probes = 1}, .random = {.probes = 8}};
    ck_assert_ptr_eq(trial_group(&both), &both.lights);
    both.lights.probes = 0;
    ck_assert_ptr_eq(trial_group(&both), &both.random);
}
END_TEST

/* The error that the laws predict of the next trial. */
static double predicted(const trial_errors *e, const trial_knobs *from, const trial_knobs *to) {
    const double C = e->compression * pow(to->epsilon / from->epsilon, .6);
    double F = e->factors * pow((double)to->recipe.rays / (double)from->recipe.rays, -.5);
    if (recipe_source(&from->recipe) == &source_pairs)
        F *= pow(to->recipe.accuracy / from->recipe.accuracy, .65);
    if (recipe_source(&from->recipe) == &source_blocks)
        F *= sqrt(to->recipe.accuracy / from->recipe.accuracy);
    return hypot(C, F);
}

/* Aims at .9 of the error asked for, whichever part is the larger; rays come in powers of two, so that their
 * part is between .7 and 1 of its aim. */
START_TEST(the_next_trial_would_keep_it) {
    const trial_knobs all[] = {of_rays, of_near, of_pairs, of_blocks};
    const double asked = .01,
                 of[][2] = {{.015, .001}, {.001, .015}, {.011, .009}, {.009, .011}, {.0099, .0099}};
    for (size_t k = 0; k < sizeof all / sizeof *all; k++) {
        for (size_t i = 0; i < sizeof of / sizeof *of; i++) {
            const trial_errors e = parts(of[i][0], of[i][1]);
            trial_knobs next;
            ck_assert(trial_turn(asked, &e, &free_knobs, &all[k], &next));
            const double error = predicted(&e, &all[k], &next);
            ck_assert_double_le(error, .9 * asked * (1 + 1e-12));
            ck_assert_double_ge(error, .6 * asked);
        }
    }
}
END_TEST

START_TEST(only_the_larger_part_is_turned) {
    const trial_errors compressed = parts(.015, .001), noisy = parts(.001, .015), even = parts(.011, .011);
    trial_knobs next;
    ck_assert(trial_turn(.01, &compressed, &free_knobs, &of_pairs, &next));
    ck_assert_double_lt(next.epsilon, of_pairs.epsilon);
    ck_assert(!recipes_differ(&next.recipe, &of_pairs.recipe));
    ck_assert(trial_turn(.01, &noisy, &free_knobs, &of_pairs, &next));
    ck_assert_double_eq(next.epsilon, of_pairs.epsilon);
    ck_assert_double_lt(next.recipe.accuracy, of_pairs.recipe.accuracy);
    ck_assert(trial_turn(.01, &even, &free_knobs, &of_pairs, &next));
    ck_assert_double_lt(next.epsilon, of_pairs.epsilon);
    ck_assert_double_lt(next.recipe.accuracy, of_pairs.recipe.accuracy);
}
END_TEST

/* A threshold that follows the noise of rays leaves them as the only knob, for all of the error. */
START_TEST(noise_leaves_rays_alone) {
    trial_errors e = {.total = .03, .compression = .04, .by_noise = true};
    trial_knobs next;
    ck_assert(trial_turn(.01, &e, &free_knobs, &of_rays, &next));
    ck_assert_double_eq(next.epsilon, of_rays.epsilon);
    ck_assert_uint_eq(next.recipe.rays, 8192); /* 512 (.03 / .009)^2 = 5,689 */
    const trial_limits given = {.rays = false, .accuracy = true};
    ck_assert(!trial_turn(.01, &e, &given, &of_rays, &next));
    ck_assert(!recipes_differ(&next.recipe, &of_rays.recipe));
}
END_TEST

START_TEST(a_part_that_stays) {
    const trial_limits none = {.rays = false};
    const trial_errors noisy = parts(.004, .008), small = parts(.004, .02), large = parts(.03, .008);
    trial_knobs next;
    /* .9 asked leaves sqrt(.009^2 - .008^2) = .0041 for compression, which is there already. */
    ck_assert(!trial_turn(.01, &noisy, &none, &of_pairs, &next));
    ck_assert(!trial_turn(.01, &small, &none, &of_pairs, &next)); /* below half of it: no use */
    ck_assert(trial_turn(.01, &large, &none, &of_pairs, &next));
    ck_assert(!recipes_differ(&next.recipe, &of_pairs.recipe));
    ck_assert_double_le(predicted(&large, &of_pairs, &next), .009 * (1 + 1e-12));
    /* Nor is compression pushed below half of an error of form factors that is too large by itself. */
    const trial_errors hopeless = parts(.03, .02);
    ck_assert(trial_turn(.01, &hopeless, &none, &of_pairs, &next));
    ck_assert_double_eq_tol(.03 * pow(next.epsilon / .01, .6), .01, 1e-12);
}
END_TEST

/* An operator that does not follow epsilon leaves the form factors as the only knob. */
START_TEST(an_epsilon_without_effect_stays) {
    const trial_limits limits = {.accuracy = true, .fixed_epsilon = true, .finest = 7e-6};
    const trial_errors compressed = parts(.03, .001), even = parts(.011, .011);
    trial_knobs next;
    ck_assert(!trial_turn(.01, &compressed, &limits, &of_pairs, &next));
    ck_assert(trial_turn(.01, &even, &limits, &of_pairs, &next));
    ck_assert_double_eq(next.epsilon, of_pairs.epsilon);
    ck_assert_double_lt(next.recipe.accuracy, of_pairs.recipe.accuracy);
}
END_TEST

/* Where four times less epsilon halved the compression, it falls as epsilon^1/2. */
START_TEST(the_measured_law_is_taken) {
    const double power = trial_power(.01, .2, .04, .4);
    ck_assert_double_eq_tol(power, .5, 1e-12);
    ck_assert_double_eq(trial_power(.01, .05, .04, .4), .6); /* it will not go on so well */
    ck_assert_double_eq(trial_power(.01, .39, .04, .4), .2);
    ck_assert_double_eq(trial_power(.01, .5, .04, .4), .2);
    ck_assert_double_eq(trial_power(.04, .2, .04, .4), 0); /* epsilon was not turned */
    ck_assert_double_eq(trial_power(.01, 0, .04, .4), 0);
    const trial_limits limits = {.power = .5};
    const trial_errors e = parts(.02, 0);
    trial_knobs next;
    ck_assert(trial_turn(.01, &e, &limits, &of_pairs, &next));
    ck_assert_double_eq_tol(next.epsilon, .01 * (.9 * .9 / 4), 1e-12);
}
END_TEST

START_TEST(goals_of_groups) {
    const worst_group worst = {.group = 2, .figure = GROUP_FAR, .total = .5, .of_operator = .3};
    const trial_goal goal = trial_goal_of_group(.1, &worst, false), none = {.errors = goal.errors};
    char text[TRIAL_WORST_TEXT], name[200];
    ck_assert_double_eq_tol(trial_excess(&goal), 5, 1e-12);
    ck_assert_double_eq(trial_excess(&none), 0);
    ck_assert_double_eq_tol(goal.errors.factors, .4, 1e-12);
    trial_describe_worst(&worst, "cellar", text);
    ck_assert_str_eq(text, "the mean of cellar by single elements that light it little");
    memset(name, 'x', sizeof name - 1);
    name[sizeof name - 1] = '\0';
    trial_describe_worst(&worst, name, text);
    ck_assert_uint_lt(strlen(text), TRIAL_WORST_TEXT - 1);
}
END_TEST

START_TEST(knobs_have_limits) {
    const trial_errors huge = parts(.9, 90), noisy = {.total = 90, .by_noise = true};
    trial_knobs next, finest = of_pairs, most = of_rays;
    ck_assert(trial_turn(.01, &huge, &free_knobs, &of_pairs, &next));
    ck_assert_double_eq(next.recipe.accuracy, free_knobs.finest);
    ck_assert(trial_turn(.01, &huge, &free_knobs, &of_blocks, &next));
    ck_assert_double_eq_tol(next.recipe.accuracy, 8e-5 / 64, 1e-18);
    ck_assert_double_eq_tol(next.epsilon, .01 / 64, 1e-15);
    ck_assert(trial_turn(.01, &noisy, &free_knobs, &of_rays, &next));
    ck_assert_uint_eq(next.recipe.rays, 512 * 64);
    most.recipe.rays = RECIPE_RAYS_MOST;
    ck_assert(!trial_turn(.01, &noisy, &free_knobs, &most, &next));
    finest.recipe.accuracy = free_knobs.finest;
    const trial_errors coarse = parts(.001, .02);
    ck_assert(!trial_turn(.01, &coarse, &free_knobs, &finest, &next));
    const trial_knobs cubes = {.epsilon = .01, .recipe = {.source = &source_hemicube, .resolution = 64}};
    ck_assert(!trial_turn(.01, &coarse, &free_knobs, &cubes, &next));
}
END_TEST

START_TEST(the_log_names_what_differs) {
    char text[TRIAL_TEXT];
    trial_knobs next = of_rays;
    trial_describe(&of_rays, &next, text);
    ck_assert_str_eq(text, "");
    next.recipe.rays = 4096;
    trial_describe(&of_rays, &next, text);
    ck_assert_str_eq(text, "4096 rays in place of 512");
    next.epsilon = .002;
    trial_describe(&of_rays, &next, text);
    ck_assert_str_eq(text, "coefficients for --epsilon 0.002 in place of 0.01, 4096 rays in place of 512");
    next = of_blocks;
    next.recipe.accuracy = 2e-5;
    trial_describe(&of_blocks, &next, text);
    ck_assert_str_eq(text, "blocks to 2e-05 in place of 8e-05");
}
END_TEST

int main(void) {
    Suite *suite = suite_create("trial");
    TCase *cases = tcase_create("trial");
    tcase_add_test(cases, parts_add_in_squares);
    tcase_add_test(cases, the_next_trial_would_keep_it);
    tcase_add_test(cases, only_the_larger_part_is_turned);
    tcase_add_test(cases, noise_leaves_rays_alone);
    tcase_add_test(cases, a_part_that_stays);
    tcase_add_test(cases, an_epsilon_without_effect_stays);
    tcase_add_test(cases, the_measured_law_is_taken);
    tcase_add_test(cases, goals_of_groups);
    tcase_add_test(cases, knobs_have_limits);
    tcase_add_test(cases, the_log_names_what_differs);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
