/* Blocks of clusters or pairs and rays: the choice by the cost of samples. */
#include "solver/base/terminal.h"
#include "solver/formfactor/blocks/blocks.h"
#include "solver/formfactor/source.h"
#include "solver/precompute/plan.h"
#include "support/building.h"
#include "support/scene.h"
#include "support/suite.h"

#include <omp.h>

/* The choice for a generated scene of about n elements, where the recipe so far is `other`. */
typedef struct outcome {
    const factor_source *source;
    double seconds;
} outcome;

static outcome choose_within(const char *scene, size_t n, recipe other, int n_threads, double memory) {
    lam_error error = {.message = ""};
    terminal t;
    const generate_options how = {.kind = scene,
                                  .elements = n,
                                  .seed = 1,
                                  .reflectance = .5,
                                  .closed = true,
                                  .variant = 1,
                                  .terrain = "flat"};
    const precompute_options options = {
        .form_factors = 0, .quality = QUALITY_NORMAL, .rays = OPTION_AUTO, .build = build_presets("auto")};
    precompute_job job = {.options = &options, .t = &t, .memory = memory};
    precompute_scene of = {.order = NULL};
    precompute_plan plan = {.method = method_find("hierarchical"), .recipe = other};
    terminal_open(&t, "test", true, false);
    job.progress = terminal_progress(&t);
    of.m = generate_good(&how);
    const int before = omp_get_max_threads();
    omp_set_num_threads(n_threads);
    ck_ok(plan_weigh_blocks(&job, &of, method_find("hierarchical"), true, &plan, &error));
    omp_set_num_threads(before);
    const outcome found = {plan.recipe.source, plan.cost.seconds};
    block_scene_destroy(of.ready);
    mesh_free(&of.m);
    plane_tree_free(&of.tree);
    return found;
}

static outcome choose(const char *scene, size_t n, recipe other, int n_threads) {
    return choose_within(scene, n, other, n_threads, 8e9);
}

static const recipe all_pairs = {.source = &source_pairs, .rays = RAYS_BESIDE_PAIRS, .accuracy = 7e-5},
                    few_rays = {.source = &source_rays, .rays = 256};

START_TEST(a_room_of_large_planes_gets_blocks) {
    const outcome one = choose("cornell", 4200, all_pairs, 1), three = choose("cornell", 4200, all_pairs, 3);
    ck_assert_ptr_eq(one.source, &source_blocks);
    ck_assert_double_gt(one.seconds, 0);
    ck_assert_ptr_eq(three.source, &source_blocks);
    ck_assert_double_eq(one.seconds, three.seconds);
}
END_TEST

/* Its planes have three elements each, and all sorts of houses stand between them: its blocks cost many times
 * as much as its rays. */
START_TEST(a_city_does_not) {
    ck_assert_ptr_eq(choose("city", 4200, few_rays, 2).source, &source_rays);
}
END_TEST

/* The city has 4.6 elements in a plane. */
START_TEST(small_scenes_get_blocks) {
    ck_assert_ptr_eq(choose("cornell", 1200, all_pairs, 1).source, &source_blocks);
    ck_assert_ptr_eq(choose("city", 1500, all_pairs, 1).source, &source_blocks);
}
END_TEST

START_TEST(a_smaller_scene_is_not_weighed) {
    const outcome found = choose("cornell", 900, all_pairs, 1);
    ck_assert_ptr_eq(found.source, &source_pairs);
    ck_assert_double_eq(found.seconds, 0);
}
END_TEST

/* 1,024 rays of 1,500 elements take less memory than blocks, which cost less time; no cost of blocks is left
 * behind. */
START_TEST(rows_are_taken_where_blocks_do_not_fit) {
    const recipe rays = {.source = &source_rays, .rays = 1024};
    ck_assert_ptr_eq(choose_within("cornell", 1500, rays, 2, 2e8).source, &source_blocks);
    const outcome tight = choose_within("cornell", 1500, rays, 2, 7e7);
    ck_assert_ptr_eq(tight.source, &source_rays);
    ck_assert_double_eq(tight.seconds, 0);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("choose blocks");
    TCase *cases = tcase_create("choose blocks");
    tcase_set_timeout(cases, 120);
    tcase_add_test(cases, a_room_of_large_planes_gets_blocks);
    tcase_add_test(cases, a_city_does_not);
    tcase_add_test(cases, small_scenes_get_blocks);
    tcase_add_test(cases, a_smaller_scene_is_not_weighed);
    tcase_add_test(cases, rows_are_taken_where_blocks_do_not_fit);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
