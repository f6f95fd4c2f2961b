/* The work of pairs that a sample of them counts, and its cost. */
#include "solver/formfactor/pairs/pairs_sample.h"
#include "solver/formfactor/source.h"
#include "support/scene.h"
#include "support/suite.h"

#include <omp.h>

static mesh scene_of(const char *kind, size_t n) {
    const generate_options how = {
        .kind = kind, .elements = n, .seed = 1, .variant = 1, .terrain = "flat", .reflectance = .5};
    return generate_good(&how);
}

static const recipe all_pairs = {.source = &source_pairs, .rays = 16, .accuracy = 7e-5, .seed = 1};

/* Samples all pairs at normal quality; occluders: 0 where neither projection nor lists are allowed. */
static pairs_work sample(const mesh *m, bool occluders, int n_threads, pairs_trial *trial) {
    lam_error error = {.message = ""};
    pairs_options options = pairs_options_of(&all_pairs, m->n, 0);
    const int most = omp_get_max_threads();
    visibility *v = NULL;
    pairs_work found;
    if (!occluders) options.occluders = 0;
    ck_ok(visibility_create(m, &v, &error));
    omp_set_num_threads(n_threads);
    ck_ok(pairs_sample(m, v, &options, &found, trial, &error));
    omp_set_num_threads(most);
    visibility_destroy(v);
    return found;
}

/* In a patio some 7 occluders, in an atrium 20, stand between pairs that take segments, as all pairs counted
 * one by one have it: .8 to .9 of the segments are tested against lists, and a tenth needs none at all. */
START_TEST(segments_are_tested_against_lists) {
    static const struct {
        const char *kind;
        double shortest, longest;
    } scenes[] = {{"patio", 4, 16}, {"atrium", 8, 40}};
    mesh m = scene_of(scenes[_i].kind, 1000);
    pairs_trial trial;
    const pairs_work w = sample(&m, true, 1, &trial), other = sample(&m, true, 3, NULL),
                     none = sample(&m, false, 1, NULL);
    ck_assert_double_gt(w.segments, 0);
    ck_assert_double_gt(w.listed, .5 * w.segments);
    ck_assert_double_gt(w.proven, 0);
    ck_assert_double_lt(w.proven, .3 * w.segments);
    ck_assert_double_le(w.listed + w.proven, 1.01 * w.segments);
    ck_assert_double_ge(w.list_tests, scenes[_i].shortest * w.listed);
    ck_assert_double_le(w.list_tests, scenes[_i].longest * w.listed);
    /* A list is made for some of the pairs that are looked at, and saves segments of 64 at least each. */
    ck_assert_double_gt(w.lists, 0);
    ck_assert_double_lt(w.lists, w.tests);
    ck_assert_double_gt(w.segments, 64 * w.lists);
    ck_assert_double_eq(none.lists + none.proven + none.listed + none.list_tests, 0);
    ck_assert_double_gt(none.segments, 0);
    /* The same bits from any number of threads; only seconds differ. */
    ck_assert_double_eq(w.segments, other.segments);
    ck_assert_double_eq(w.lists, other.lists);
    ck_assert_double_eq(w.proven, other.proven);
    ck_assert_double_eq(w.listed, other.listed);
    ck_assert_double_eq(w.list_tests, other.list_tests);
    ck_assert_double_gt(trial.link_seconds, 0);
    ck_assert_double_gt(trial.seconds, 0);
    mesh_free(&m);
}
END_TEST

/* Walls of rooms are few: their pairs are projected, and take no segments. */
START_TEST(projected_pairs_take_no_segments) {
    mesh m = scene_of("rooms", 1000);
    const pairs_work w = sample(&m, true, 1, NULL);
    ck_assert_double_gt(w.sifted, 0);
    ck_assert_double_gt(w.saved, 0);
    ck_assert_double_eq(w.segments + w.lists + w.listed, 0);
    mesh_free(&m);
}
END_TEST

/* At a coarse accuracy eight segments are enough for small factors, which are tested unless few occluders
 * prove them open or hidden. */
START_TEST(coarse_pairs_are_tested) {
    lam_error error = {.message = ""};
    mesh m = scene_of("rooms", 1000);
    visibility *v = NULL;
    recipe coarse = all_pairs;
    coarse.accuracy = 2.8e-4;
    const pairs_options how[2] = {pairs_options_of(&all_pairs, m.n, 0), pairs_options_of(&coarse, m.n, 0)};
    pairs_work sampled[2];
    pairs_report found[2];
    ck_ok(visibility_create(&m, &v, &error));
    for (int k = 0; k < 2; k++) {
        csr G;
        ck_ok(pairs_sample(&m, v, &how[k], &sampled[k], NULL, &error));
        ck_ok(pairs_exchange(&m, v, &how[k], &G, &found[k], NULL, &error));
        csr_free(&G);
    }
    ck_assert_double_lt(found[1].projected, .2 * found[0].projected);
    ck_assert_double_gt(found[1].projected, 0);
    ck_assert_double_lt(sampled[1].projection, .5 * sampled[0].projection);
    ck_assert_double_gt(sampled[1].tests, 10 * sampled[0].tests);
    ck_assert_double_gt(found[1].hidden + found[1].open, 0);
    ck_assert_double_eq_tol(sampled[1].seen / sampled[0].seen, 1, .05);
    visibility_destroy(v);
    mesh_free(&m);
}
END_TEST

/* Segments against lists cost a tenth to a quarter of those cast into the scene, and segments are most of the
 * work of an atrium's pairs: with lists it is less than if each segment took the 1.75e-7 s of a cast one. */
START_TEST(lists_make_pairs_cheaper) {
    lam_error error = {.message = ""};
    mesh m = scene_of("atrium", 1000);
    const pairs_work w = sample(&m, true, 1, NULL);
    factor_cost cost;
    ck_ok(pairs_cost(&m, &all_pairs, 0, NULL, &cost, &error));
    const double segments = fmin(w.segments, pairs_options_of(&all_pairs, m.n, 0).segments_most);
    ck_assert_double_gt(cost.seconds, 2e-8 * segments);
    ck_assert_double_lt(cost.seconds, 1.75e-7 * segments);
    ck_assert_double_gt(cost.measured, 0);
    mesh_free(&m);
}
END_TEST

/* Few segments are made finer all together, up to segments_least, and are counted as they will be cast. */
START_TEST(segments_are_counted_as_they_are_cast) {
    lam_error error = {.message = ""};
    mesh m = scene_of("patio", 1000);
    visibility *v = NULL;
    recipe coarse = all_pairs;
    coarse.accuracy = 5.6e-4;
    const pairs_options how = pairs_options_of(&coarse, m.n, 0);
    const double wanted = fmin(how.segments_least, how.segments_most);
    pairs_work w;
    ck_ok(visibility_create(&m, &v, &error));
    ck_ok(pairs_sample(&m, v, &how, &w, NULL, &error));
    ck_assert_double_eq_tol(w.segments / wanted, 1, .15);
    visibility_destroy(v);
    mesh_free(&m);
}
END_TEST

/* From an accuracy to one that is three times as coarse the segments' part is within a quarter of what a
 * sample there has, and within a half the other way, where lists begin to pay. */
START_TEST(costs_follow_the_accuracy) {
    lam_error error = {.message = ""};
    mesh m = scene_of("atrium", 1000);
    recipe coarse = all_pairs;
    coarse.accuracy *= 3;
    factor_cost fine, less;
    ck_ok(pairs_cost(&m, &all_pairs, 0, NULL, &fine, &error));
    ck_ok(pairs_cost(&m, &coarse, 0, NULL, &less, &error));
    const double at_coarse = pairs_cost_at(&fine, all_pairs.accuracy, coarse.accuracy) - fine.measured,
                 at_fine = pairs_cost_at(&less, coarse.accuracy, all_pairs.accuracy) - less.measured;
    ck_assert_double_lt(less.segments, .5 * fine.segments);
    ck_assert_double_eq_tol(at_coarse / (less.segments - fine.segments), 1, .25);
    ck_assert_double_eq_tol(at_fine / (fine.segments - less.segments), 1, .5);
    ck_assert_double_eq(pairs_cost_at(&fine, 1e-4, 1e-4), fine.measured);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("pairs_sample");
    TCase *cases = tcase_create("pairs_sample");
    tcase_set_timeout(cases, 120);
    tcase_add_loop_test(cases, segments_are_tested_against_lists, 0, 2);
    tcase_add_test(cases, projected_pairs_take_no_segments);
    tcase_add_test(cases, segments_are_counted_as_they_are_cast);
    tcase_add_test(cases, coarse_pairs_are_tested);
    tcase_add_test(cases, lists_make_pairs_cheaper);
    tcase_add_test(cases, costs_follow_the_accuracy);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
