/* The line about a large error: when there is one, about which emission, and with which option. */
#include "solver/formfactor/source.h"
#include "solver/precompute/error_advice.h"
#include "support/suite.h"

#include <string.h>

/* The advice where total and operator errors of the lights (0: none) and of random emission are such. */
static void advice_of(recipe r, double lights, double of_lights, double random, double of_random,
                      char text[ERROR_ADVICE_BYTES]) {
    const error_report errors = {.lights = {.probes = lights > 0,
                                            .total_indirect = {lights, 0, lights},
                                            .operator_indirect = {of_lights, 0, of_lights}},
                                 .random = {.probes = 8,
                                            .total_indirect = {random, 0, random},
                                            .operator_indirect = {of_random, 0, of_random}},
                                 .has_total = true};
    const error_advice_input input = {.errors = &errors, .recipe = r, .epsilon = .05};
    memset(text, 'x', ERROR_ADVICE_BYTES);
    error_advice(&input, text);
}

static const recipe rays = {.source = &source_rays, .rays = 1024},
                    pairs = {.source = &source_pairs, .rays = 256},
                    blocks = {.source = &source_blocks, .rays = 8}, cubes = {.source = &source_hemicube},
                    near = {.source = &source_near_pairs, .rays = 512};

START_TEST(a_small_error_needs_none) {
    char text[ERROR_ADVICE_BYTES];
    advice_of(rays, 0, 0, .0299, .001, text);
    ck_assert_str_eq(text, "");
    advice_of(rays, .03, .03, .03, .03, text);
    ck_assert_str_eq(text, "");
    const error_report unknown = {.random = {.probes = 8, .total_indirect = {.9, 0, .9}}};
    const error_advice_input input = {.errors = &unknown, .recipe = rays, .epsilon = .05};
    error_advice(&input, text);
    ck_assert_str_eq(text, "");
}
END_TEST

START_TEST(the_worst_group_comes_first) {
    char text[ERROR_ADVICE_BYTES];
    const error_report errors = {.random = {.probes = 8, .total_indirect = {.04, 0, .04}}, .has_total = true};
    const worst_group worst = {.group = 1, .figure = GROUP_FAR, .total = .5, .of_operator = .49};
    error_advice_input input = {.errors = &errors,
                                .recipe = pairs,
                                .epsilon = .05,
                                .group_asked = .1,
                                .worst = &worst,
                                .worst_name = "cellar"};
    error_advice(&input, text);
    ck_assert_str_eq(text,
                     "the error of the mean of cellar by single elements that light it little is stated as "
                     "0.5, above 0.1 of --group-error; --epsilon 0.01 would lower it");
    input.other_method = "other";
    error_advice(&input, text);
    ck_assert_ptr_nonnull(strstr(text, "; --method other would"));
    input.trials_left = 3;
    error_advice(&input, text);
    ck_assert_ptr_nonnull(strstr(text, "; --trials 3 would"));
    input.asked = .004; /* --epsilon is missed by a factor of 10, the group by 5 */
    error_advice(&input, text);
    ck_assert_ptr_nonnull(strstr(text, "random emission is stated as 0.04, above 0.004 of --epsilon"));
    input.asked = 0;
    input.group_asked = .5; /* which is kept */
    error_advice(&input, text);
    ck_assert_ptr_nonnull(strstr(text, "random emission is stated as 0.04, above 0.03;"));
}
END_TEST

/* Noise falls with the root of the rays: 1.5 times too much takes 2.25 times the rays, 4,096 as a power. */
START_TEST(noise_takes_rays) {
    char text[ERROR_ADVICE_BYTES];
    advice_of(rays, 0, 0, .034, .01, text);
    ck_assert_str_eq(
        text, "the indirect error of random emission is stated as 0.034, above 0.03; --rays 2048 would "
              "lower it");
    advice_of(rays, .045, .01, .034, .01, text);
    ck_assert_str_eq(text,
                     "the indirect error of the scene's own lights is stated as 0.045, above 0.03; --rays "
                     "4096 would lower it");
    advice_of(near, .2, 0, .5, .1, text);
    ck_assert_ptr_nonnull(strstr(text, "random emission is stated as 0.5"));
    ck_assert_ptr_nonnull(strstr(text, "--rays 262144 ")); /* 512 (.5 / .03)^2 = 142,222 */
    advice_of(rays, 30, 0, .034, .01, text);
    ck_assert_ptr_nonnull(strstr(text, "--rays 16777216 ")); /* the most that there may be */
}
END_TEST

START_TEST(compression_takes_epsilon) {
    char text[ERROR_ADVICE_BYTES];
    advice_of(rays, 0, 0, .06, .05, text);
    ck_assert_ptr_nonnull(strstr(text, "; --epsilon 0.02 would"));
    advice_of(pairs, .1, .099, .01, 0, text);
    ck_assert_ptr_nonnull(strstr(text, "; --epsilon 0.01 would"));
    advice_of(blocks, .05, 0, .01, 0, text); /* the accuracy of blocks follows from it too */
    ck_assert_ptr_nonnull(strstr(text, "; --epsilon 0.03 would"));
}
END_TEST

START_TEST(other_recipes) {
    char text[ERROR_ADVICE_BYTES];
    advice_of(pairs, .1, .01, .01, 0, text);
    ck_assert_ptr_nonnull(strstr(text, "; --quality high would"));
    advice_of(cubes, .1, .01, .01, 0, text);
    ck_assert_ptr_nonnull(strstr(text, "; --form-factors rays would"));
    const error_report errors = {.random = {.probes = 8, .total_indirect = {.05, 0, .05}}, .has_total = true};
    const error_advice_input fine = {.errors = &errors, .recipe = pairs, .epsilon = .05, .finest = true},
                             kept = {.errors = &errors, .recipe = rays, .epsilon = .05, .from_store = true};
    error_advice(&fine, text);
    ck_assert_ptr_nonnull(strstr(text, "; a finer mesh would"));
    const error_report coarse = {
        .random = {.probes = 8, .total_indirect = {.05, 0, .05}, .operator_indirect = {.049, 0, .049}},
        .has_total = true};
    const error_advice_input noisy = {.errors = &coarse, .recipe = rays, .epsilon = .05, .by_noise = true};
    error_advice(&noisy, text); /* compressed as far as the rays' noise lets it be */
    ck_assert_ptr_nonnull(strstr(text, "; --rays 4096 would"));
    error_advice(&kept, text);
    ck_assert_ptr_nonnull(strstr(text, "; the scene precomputed with --rays 4096 would"));
}
END_TEST

/* The error that --epsilon asks for is that of the lights alone, where there are any. */
START_TEST(an_error_asked_for) {
    char text[ERROR_ADVICE_BYTES];
    const error_report errors = {
        .lights = {.probes = 1, .total_indirect = {.012, 0, .012}, .operator_indirect = {.002, 0, .002}},
        .random = {.probes = 8, .total_indirect = {.5, 0, .5}, .operator_indirect = {.5, 0, .5}},
        .has_total = true};
    error_advice_input input = {.errors = &errors, .recipe = rays, .asked = .012, .epsilon = .001};
    error_advice(&input, text);
    ck_assert_str_eq(text, "");
    input.asked = .01; /* 1,024 (.012 / .01)^2 = 1,475 */
    error_advice(&input, text);
    ck_assert_str_eq(text, "the indirect error of the scene's own lights is stated as 0.012, above 0.01 of "
                           "--epsilon; --rays 2048 would lower it");
    input.lacking = 0x1p31;
    error_advice(&input, text);
    ck_assert_ptr_nonnull(strstr(text, "; --memory 2.0G would"));
    input = (error_advice_input){.errors = &errors, .recipe = blocks, .asked = .01, .epsilon = .001};
    error_advice(&input, text); /* the largest number of one digit below .001 / 1.2 */
    ck_assert_ptr_nonnull(strstr(text, "; --epsilon 0.0008 would"));
    input.spent = true;
    error_advice(&input, text);
    ck_assert_ptr_nonnull(strstr(text, "; --form-factors rays would"));
    input.recipe = pairs;
    error_advice(&input, text);
    ck_assert_ptr_nonnull(strstr(text, "; a finer mesh would"));
}
END_TEST

START_TEST(a_sky_takes_rays_or_portals) {
    char text[ERROR_ADVICE_BYTES];
    error_report errors = {.sky = {.probes = 8, .total_relative = {.12, 0, .2}}, .has_total = true};
    const error_advice_input input = {.errors = &errors, .recipe = rays, .epsilon = .05};
    error_advice_sky(&input, .01, 2, text);
    ck_assert_str_eq(
        text, "the error of light from the sky is stated as 0.12, above 0.1; 2 openings were found: --portal "
              "GROUP names faces that stand in each; or take more --rays");
    error_advice_sky(&input, .2, 1, text);
    ck_assert_ptr_nonnull(strstr(text, "; 1 opening was found: --portal GROUP names"));
    error_advice_sky(&input, .01, 0, text);
    ck_assert_ptr_nonnull(strstr(text, "no window was found: --portal GROUP"));
    error_advice_sky(&input, .6, 0, text); /* an open scene has no windows */
    ck_assert_str_eq(text, "");
    errors.sky.total_relative.mean = .1;
    error_advice_sky(&input, .01, 2, text);
    ck_assert_str_eq(text,
                     "the error of light from the sky is stated as 0.1, above 0.03; more --rays lower it");
    error_advice_sky(&input, .2, 0, text);
    ck_assert_str_eq(text, "");
    error_advice_sky(&input, .01, 0, text);
    ck_assert_ptr_nonnull(strstr(text, "no window was found: --portal GROUP"));
    errors.sky.total_relative.mean = .0299;
    error_advice_sky(&input, .01, 0, text);
    ck_assert_str_eq(text, "");
}
END_TEST

int main(void) {
    Suite *suite = suite_create("error_advice");
    TCase *cases = tcase_create("error_advice");
    tcase_add_test(cases, a_small_error_needs_none);
    tcase_add_test(cases, the_worst_group_comes_first);
    tcase_add_test(cases, noise_takes_rays);
    tcase_add_test(cases, compression_takes_epsilon);
    tcase_add_test(cases, other_recipes);
    tcase_add_test(cases, an_error_asked_for);
    tcase_add_test(cases, a_sky_takes_rays_or_portals);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
