/* The forecast of the work of blocks beside the work itself. */
#include "solver/formfactor/blocks/blocks_importance.h"
#include "solver/formfactor/blocks/blocks_sample.h"
#include "solver/formfactor/source.h"
#include "support/blocks.h"
#include "support/scene.h"

#include <omp.h>

static const struct {
    const char *kind;
    size_t elements;
} scenes[] = {{"cornell", 6000}, {"rooms", 3000}, {"atrium", 2000}, {"maze", 2000}, {"city", 1500}};
enum { SCENES = sizeof scenes / sizeof *scenes };
/* A sanitizer watches the same code in each scene: a closed and an open one are enough. */
#ifdef LAMBERT_FEW_CASES
enum { FIRST_SCENE = SCENES - 2 };
#else
enum { FIRST_SCENE = 0 };
#endif

static block_report sample(const mesh *m, int n_threads, block_report *whole, blocks_trial *trial) {
    lam_error error = {.message = ""};
    const block_options options = {.open = blocks_open, .shadow = blocks_shadow, .exact = 1e-5, .seed = 1};
    const int most = omp_get_max_threads();
    plane_tree tree;
    block_report found;
    block_scene *scene = NULL;
    ck_ok(form_factors_tree(m, &tree, &error));
    omp_set_num_threads(n_threads);
    ck_ok(block_scene_make(m, &tree, &scene, &error));
    ck_ok(blocks_sample(scene, &options, &found, trial, &error));
    omp_set_num_threads(most);
    if (whole != NULL) {
        block_factors f;
        ck_ok(blocks_find_in(scene, &options, &f, whole, NULL, &error));
        block_factors_free(&f);
    }
    block_scene_destroy(scene);
    plane_tree_free(&tree);
    return found;
}

/* Within half as much again: of the work that costs most in some scene. */
static void check_near(const char *kind, const char *what, double found, double all) {
    ck_assert_msg(found <= 1.5 * all && all <= 1.5 * found, "%s, %s: %g for %g", kind, what, found, all);
}

START_TEST(a_sample_tells_the_work) {
    const generate_options how = {.kind = scenes[_i].kind,
                                  .elements = scenes[_i].elements,
                                  .seed = 1,
                                  .variant = 1,
                                  .terrain = "flat",
                                  .reflectance = .5};
    mesh m = generate_good(&how);
    block_report whole;
    blocks_trial trial;
    const block_report found = sample(&m, 1, &whole, &trial), again = sample(&m, 3, NULL, NULL);
    check_near(how.kind, "visits", found.visits, whole.visits);
    check_near(how.kind, "pieces", found.sifted, whole.sifted);
    check_near(how.kind, "segments", found.segments, whole.segments);
    check_near(how.kind, "blocks", found.linear + found.pairs + found.shaded + found.shaded_pairs,
               whole.linear + whole.pairs + whole.shaded + whole.shaded_pairs);
    /* The same figures from any number of threads. */
    ck_assert_double_eq(found.visits, again.visits);
    ck_assert_double_eq(found.sifted, again.sifted);
    ck_assert_double_eq(found.segments, again.segments);
    /* The walk of the sample did a fraction of the work that it stands for: each pair of nodes below the
     * first of the limits counts at least twice, and nearly all work is below. */
    ck_assert_double_gt(trial.seconds, 0);
    ck_assert_double_gt(trial.work.visits, 0);
    ck_assert_double_gt(found.visits, 2 * trial.work.visits);
    ck_assert_double_gt(found.segments, 2 * trial.work.segments);
    mesh_free(&m);
}
END_TEST

/* Blocks that are found for what the lamp of a box receives are a good deal fewer, and the forecast counts
 * these, and those of half the bound that a judge takes. */
START_TEST(forecasts_know_receivers) {
    const generate_options how = {.kind = "cornell", .elements = 3000, .closed = true, .reflectance = .5};
    const recipe r = {.source = &source_blocks, .rays = 1, .accuracy = blocks_open, .seed = 1};
    const recipe judge = recipe_of_judge(&r, 1, 0);
    lam_error error = {.message = ""};
    mesh m = generate_good(&how);
    importance read = {.n = m.n, .read = calloc(m.n, sizeof(float))}, even;
    const size_t lamp = group_find(&m, "lamp");
    plane_tree tree;
    block_scene *scene = NULL;
    factor_cost of_all, of_read;
    block_factors f;
    block_report found, halves;
    for (size_t i = 0; i < m.n; i++) read.read[i] = m.group[i] == lamp;
    ck_ok(form_factors_tree(&m, &tree, &error));
    ck_ok(block_scene_make(&m, &tree, &scene, &error));
    block_options options = block_options_of(&r), finer = block_options_of(&judge);
    ck_ok(blocks_importance(&m, block_scene_visibility(scene), &tree, &options, &read, &error));
    ck_ok(blocks_forecast(scene, &r, NULL, NULL, &of_all, &error));
    ck_ok(blocks_forecast(scene, &r, &read, NULL, &of_read, &error));
    ck_ok(importance_even_out(&read, &even, &error));
    options.importance = &read;
    ck_ok(blocks_find_in(scene, &options, &f, &found, NULL, &error));
    block_factors_free(&f);
    block_scene_destroy(scene);
    finer.importance = &even;
    ck_ok(block_scene_make(&m, &tree, &scene, &error));
    ck_ok(blocks_sample(scene, &finer, &halves, NULL, &error));
    check_near("cornell", "blocks for the lamp", of_read.entries / 2,
               found.linear + found.even + found.pairs + found.shaded + found.shaded_pairs);
    ck_assert_double_lt(of_read.entries, .9 * of_all.entries);
    ck_assert_double_lt(of_read.seconds, of_all.seconds);
    ck_assert_double_gt(of_read.finer / of_read.measured, 1);
    ck_assert_double_gt(halves.segments, found.segments);
    block_scene_destroy(scene);
    importance_free(&even);
    importance_free(&read);
    plane_tree_free(&tree);
    mesh_free(&m);
}
END_TEST

/* Finer blocks have finer shadows, but not in step; coarser ones keep the share of the default's. */
START_TEST(shadows_grow_finer_with_the_fourth_root) {
    const double accuracy = 2.4e-4;
    recipe r = {.source = &source_blocks, .accuracy = accuracy};
    const double bound = recipe_shadow(&r);
    r.accuracy = accuracy / 16;
    ck_assert_double_eq_tol(recipe_shadow(&r), bound / 8, 1e-9 * bound);
    r.accuracy = accuracy * 16;
    ck_assert_double_eq_tol(recipe_shadow(&r), bound * 16, 1e-9 * bound);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("blocks sample");
    TCase *cases = tcase_create("blocks sample");
    tcase_set_timeout(cases, 240);
    tcase_add_loop_test(cases, a_sample_tells_the_work, FIRST_SCENE, SCENES);
    tcase_add_test(cases, forecasts_know_receivers);
    tcase_add_test(cases, shadows_grow_finer_with_the_fourth_root);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
