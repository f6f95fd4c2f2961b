/* All pairs, near pairs or rays: the choice by the cost of a sample. */
#include "solver/base/terminal.h"
#include "solver/formfactor/source.h"
#include "solver/precompute/plan.h"
#include "solver/precompute/stages.h"
#include "support/building.h"
#include "support/scene.h"
#include "support/suite.h"

#include <omp.h>
#include <string.h>

/* The outcome of the choice for a generated scene of about n elements. */
typedef struct outcome {
    bool too_slow, rays_alone;
    size_t rays;
    double seconds, entries;
} outcome;

static outcome weigh_kept(const char *scene, size_t n, factor_quality quality, int n_threads,
                          const factor_source *source, double memory, const char *keep) {
    lam_error error = {0};
    terminal t;
    const generate_options how = {.kind = scene,
                                  .elements = n,
                                  .seed = 1,
                                  .reflectance = -1,
                                  .variant = strcmp(scene, "city") == 0 ? 3 : 0,
                                  .terrain = strcmp(scene, "city") == 0 ? "flat" : NULL};
    const precompute_options options = {.form_factors = 0,
                                        .quality = quality,
                                        .rays = OPTION_AUTO,
                                        .build = build_presets("auto"),
                                        .keep_form_factors = keep};
    precompute_job job = {.options = &options, .t = &t, .memory = memory};
    precompute_scene of = {.order = NULL};
    precompute_plan plan = {.method = method_find("hierarchical")};
    plan.recipe = (recipe){
        .source = source, .rays = source == &source_pairs ? RAYS_BESIDE_PAIRS : 512, .accuracy = 7e-5};
    terminal_open(&t, "test", true, false);
    job.progress = terminal_progress(&t);
    of.m = generate_good(&how);
    const int before = omp_get_max_threads();
    omp_set_num_threads(n_threads);
    ck_ok(plan_weigh_pairs(&job, &of, &plan, &error));
    omp_set_num_threads(before);
    const outcome found = {plan.weighed.too_slow, plan.weighed.rays_alone, plan.weighed.least_rays,
                           plan.cost.seconds, plan.cost.entries};
    mesh_free(&of.m);
    return found;
}

static outcome weigh_recipe(const char *scene, size_t n, factor_quality quality, int n_threads,
                            const factor_source *source, double memory) {
    return weigh_kept(scene, n, quality, n_threads, source, memory, NULL);
}

static outcome weigh(const char *scene, size_t n, factor_quality quality, int n_threads) {
    return weigh_recipe(scene, n, quality, n_threads, &source_pairs, 1e15);
}

/* Leaves of a canopy hide one another everywhere: their pairs cost a minute and a half, rays nine seconds. */
START_TEST(a_soup_gets_rays) {
    const outcome one = weigh("canopy", 6000, QUALITY_NORMAL, 1),
                  three = weigh("canopy", 6000, QUALITY_NORMAL, 3);
    ck_assert(one.too_slow);
    ck_assert(one.rays_alone);
    ck_assert_uint_gt(one.rays, 0);
    ck_assert_double_gt(one.seconds, 0);
    /* The same bits from any number of threads. */
    ck_assert_int_eq(one.too_slow, three.too_slow);
    ck_assert_int_eq(one.rays_alone, three.rays_alone);
    ck_assert_uint_eq(one.rays, three.rays);
    ck_assert_double_eq(one.seconds, three.seconds);
    ck_assert_double_eq(one.entries, three.entries);
}
END_TEST

START_TEST(a_plain_room_keeps_its_pairs) {
    for (int k = 0; k < 2; k++) {
        const outcome found = weigh("cornell", k == 0 ? 600 : 2000, QUALITY_NORMAL, 2);
        ck_assert(!found.too_slow);
        ck_assert_uint_eq(found.rays, 0);
        ck_assert_double_gt(found.seconds, 0);
    }
}
END_TEST

/* Pairs that are as coarse as an operator allows are worth less than those that are kept. */
START_TEST(kept_pairs_may_take_longer) {
    const outcome coarse = weigh("canopy", 2500, QUALITY_NORMAL, 2),
                  kept = weigh_kept("canopy", 2500, QUALITY_NORMAL, 2, &source_pairs, 1e15, "");
    ck_assert_double_gt(kept.seconds, 8);
    ck_assert_double_lt(kept.seconds, 16);
    ck_assert(coarse.too_slow);
    ck_assert(!kept.too_slow);
}
END_TEST

/* Coarse pairs that take about as long as rays, whose judge costs less. */
START_TEST(coarse_pairs_give_way_to_rays) {
    const outcome coarse = weigh("city", 2500, QUALITY_NORMAL, 2),
                  kept = weigh_kept("city", 2500, QUALITY_NORMAL, 2, &source_pairs, 1e15, "");
    ck_assert(coarse.too_slow);
    ck_assert(coarse.rays_alone);
    ck_assert_double_gt(coarse.seconds, 2);
    ck_assert(!kept.too_slow);
}
END_TEST

/* High quality asks for the accuracy of pairs, and may take longer. */
START_TEST(high_quality_keeps_pairs_for_longer) {
    ck_assert(weigh("canopy", 4000, QUALITY_NORMAL, 2).too_slow);
    ck_assert(!weigh("canopy", 4000, QUALITY_HIGH, 2).too_slow);
}
END_TEST

/* Twice the elements have four times the pairs. */
START_TEST(more_elements_cost_more) {
    const outcome few = weigh("cornell", 1600, QUALITY_NORMAL, 2),
                  many = weigh("cornell", 3200, QUALITY_NORMAL, 2);
    /* Four times the pairs, and some of the cost is a floor of segments. */
    ck_assert_double_gt(many.seconds, 1.2 * few.seconds);
    ck_assert_double_gt(many.entries, 2 * few.entries);
}
END_TEST

/* Near pairs of leaves stand in a crowd and cost many times what rays do; those of walls cost next to
 * nothing.
 */
START_TEST(near_pairs_are_weighed_too) {
    const outcome soup = weigh_recipe("canopy", 9000, QUALITY_NORMAL, 1, &source_near_pairs, 1e15),
                  again = weigh_recipe("canopy", 9000, QUALITY_NORMAL, 3, &source_near_pairs, 1e15),
                  room = weigh_recipe("cornell", 40000, QUALITY_NORMAL, 2, &source_near_pairs, 1e15);
    ck_assert(soup.too_slow);
    ck_assert(soup.rays_alone);
    ck_assert_uint_eq(soup.rays, 2 * 512);
    ck_assert_uint_eq(soup.rays, again.rays);
    ck_assert_double_eq(soup.seconds, again.seconds);
    ck_assert(!room.too_slow);
    ck_assert(!room.rays_alone);
    ck_assert_uint_eq(room.rays, 0);
    ck_assert_double_gt(room.seconds, 0);
}
END_TEST

/* Where there is no memory for the rows of twice the rays, near pairs stay. */
START_TEST(rays_in_place_of_near_pairs_must_fit) {
    const outcome tight = weigh_recipe("canopy", 9000, QUALITY_NORMAL, 2, &source_near_pairs, 1e6),
                  free = weigh_recipe("canopy", 9000, QUALITY_NORMAL, 2, &source_near_pairs, 1e15);
    ck_assert(!tight.too_slow);
    ck_assert_double_gt(tight.seconds, free.seconds);
    ck_assert(free.too_slow);
    ck_assert_uint_eq(free.rays, 1024);
}
END_TEST

/* Entries by rays are counted: pairs of a city are hit again and again, those of a canopy rarely. One element
 * in sixteen tells the mean of numbers that vary by their own size or less, so that five standard errors are
 * .6 of it; truth is one-sided within that. */
START_TEST(entries_of_rays_are_counted) {
    lam_error error = {0};
    const generate_options how = {.kind = _i == 0 ? "city" : "canopy",
                                  .variant = 1,
                                  .terrain = "flat",
                                  .elements = 1200,
                                  .seed = 1,
                                  .reflectance = -1};
    const recipe rays = {.source = &source_rays, .rays = 1024, .seed = 3};
    const precompute_options options = {.form_factors = 0}, of_store = {.from_store = true};
    precompute_job job = {.options = &options};
    precompute_scene scene = {.m = generate_good(&how)};
    precompute_plan plan = {.recipe = rays};
    precompute_factors factors = {.scratch = NULL};
    const form_factor_options make = {.recipe = rays};
    uint32_t *order = calloc(scene.m.n, sizeof *order);
    ck_assert_ptr_nonnull(order);
    for (size_t i = 0; i < scene.m.n; i++) order[i] = (uint32_t)i;
    ck_ok(form_factors_make(&scene.m, order, &make, &factors.f, &error));
    const double truth = (double)factors.f.F.indptr[scene.m.n];
    ck_ok(plan_count_entries(&job, &scene, &plan, &factors, &error));
    ck_assert_double_eq_tol(plan.cost.entries, truth, .6 * truth);
    /* A law of .3 entries a ray that hits would be far off in the city. */
    if (_i == 0) ck_assert_double_lt(truth, .1 * .3 * (double)(rays.rays * scene.m.n));
    job.options = &of_store;
    ck_ok(plan_count_entries(&job, &scene, &plan, &factors, &error));
    ck_assert_double_eq(plan.cost.entries, truth);
    plan.recipe.source = &source_pairs;
    plan.cost.entries = 7;
    ck_ok(plan_count_entries(&job, &scene, &plan, &factors, &error));
    ck_assert_double_eq(plan.cost.entries, 7);
    form_factors_free(&factors.f);
    free(order);
    mesh_free(&scene.m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("weigh_pairs");
    TCase *cases = tcase_create("weigh_pairs");
    tcase_set_timeout(cases, 300);
    tcase_add_test(cases, a_soup_gets_rays);
    tcase_add_test(cases, a_plain_room_keeps_its_pairs);
    tcase_add_test(cases, kept_pairs_may_take_longer);
    tcase_add_test(cases, coarse_pairs_give_way_to_rays);
    tcase_add_test(cases, high_quality_keeps_pairs_for_longer);
    tcase_add_test(cases, more_elements_cost_more);
    tcase_add_test(cases, near_pairs_are_weighed_too);
    tcase_add_test(cases, rays_in_place_of_near_pairs_must_fit);
    tcase_add_loop_test(cases, entries_of_rays_are_counted, 0, 2);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
