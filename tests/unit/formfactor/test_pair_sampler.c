/* Point pairs: a Sobol' sequence with a digital shift for each pair, and what segments between them estimate.
 */
#include "solver/base/random.h"
#include "solver/formfactor/sight/occlusion.h"
#include "solver/formfactor/visibility/sample.h"
#include "support/box.h"
#include "support/suite.h"

#include <math.h>
#include <string.h>

enum { DIMENSIONS = 4 };

START_TEST(packets_are_places) {
    for (uint32_t seed = 0; seed < 20; seed++) {
        const uint32_t first = 8 * (uint32_t)(random_hash(seed) % (1u << 24));
        double x[DIMENSIONS][VISIBILITY_PACKET];
        pair_sampler s;
        pair_sampler_init(&s, seed, 3, 7 + seed);
        pair_sampler_packet(&s, first, x);
        for (uint32_t k = 0; k < VISIBILITY_PACKET; k++) {
            double one[DIMENSIONS];
            pair_sampler_place(&s, first + k, one);
            for (int d = 0; d < DIMENSIONS; d++) ck_assert_double_eq(x[d][k], one[d]);
        }
    }
}
END_TEST

/* A digital shift keeps the nets: of the first 2^k points each of 2^k equal intervals has one in each
 * dimension, and each rectangle of 2^-a by 2^(a-k) in the first two. */
START_TEST(powers_of_two_are_even) {
    enum { MOST = 10 };
    pair_sampler s;
    pair_sampler_init(&s, (uint64_t)_i, 11, 4);
    for (int k = 0; k <= MOST; k++) {
        const uint32_t n = 1u << k;
        static bool taken[DIMENSIONS + MOST + 1][1 << MOST];
        memset(taken, 0, sizeof taken);
        for (uint32_t index = 0; index < n; index++) {
            double x[DIMENSIONS];
            pair_sampler_place(&s, index, x);
            for (int d = 0; d < DIMENSIONS; d++) {
                bool *at = &taken[d][(uint32_t)(x[d] * n)];
                ck_assert(!*at);
                *at = true;
            }
            for (int a = 0; a <= k; a++) {
                const uint32_t u = (uint32_t)(x[0] * (1u << a)), w = (uint32_t)(x[1] * (1u << (k - a)));
                bool *at = &taken[DIMENSIONS + a][u << (k - a) | w];
                ck_assert(!*at);
                *at = true;
            }
        }
    }
}
END_TEST

/* The mean of prod (1/2 + x_d) is 1; of 4,096 independent points it would be off by
 * ((13/12)^4 - 1)^1/2 / 64 = .0096. Four points of the sequence beside each other fill the whole cube only if
 * no two dimensions are alike. */
START_TEST(all_dimensions_together_are_even) {
    enum { POINTS = 4096 };
    double mean = 0;
    pair_sampler s;
    pair_sampler_init(&s, (uint64_t)_i, 1, 2);
    for (uint32_t index = 0; index < POINTS; index++) {
        double x[DIMENSIONS], product = 1;
        pair_sampler_place(&s, index, x);
        for (int d = 0; d < DIMENSIONS; d++) product *= .5 + x[d];
        mean += product / POINTS;
    }
    ck_assert_double_eq_tol(mean, 1, .0096 / 10);
}
END_TEST

/* One point of many pairs, or of many seeds: its mean is 1/2 and that of two of its coordinates, and of those
 * of pairs beside each other, 1/4, each to five standard errors, (1/12)^1/2 and (1/9 - 1/16)^1/2 = .22 over
 * the root of their number. */
START_TEST(points_of_pairs_are_independent) {
    enum { PAIRS = 20000 };
    double mean[DIMENSIONS] = {0}, both[DIMENSIONS][DIMENSIONS] = {{0}}, beside[DIMENSIONS] = {0},
           before[DIMENSIONS] = {0};
    for (uint32_t k = 0; k <= PAIRS; k++) {
        double x[DIMENSIONS];
        pair_sampler s;
        if (_i == 0)
            pair_sampler_init(&s, k, 5, 6);
        else if (_i == 1)
            pair_sampler_init(&s, 1, k, 6);
        else
            pair_sampler_init(&s, 1, 5, k);
        pair_sampler_place(&s, 21, x);
        for (int d = 0; d < DIMENSIONS && k > 0; d++) {
            mean[d] += x[d] / PAIRS;
            for (int e = 0; e < d; e++) both[d][e] += x[d] * x[e] / PAIRS;
            beside[d] += x[d] * before[d] / PAIRS;
        }
        memcpy(before, x, sizeof x);
    }
    for (int d = 0; d < DIMENSIONS; d++) {
        ck_assert_double_eq_tol(mean[d], .5, 5 * .2887 / sqrt(PAIRS));
        for (int e = 0; e < d; e++) ck_assert_double_eq_tol(both[d][e], .25, 5 * .2205 / sqrt(PAIRS));
        ck_assert_double_eq_tol(beside[d], .25, 5 * .2205 / sqrt(PAIRS));
    }
}
END_TEST

/* Two opposite unit squares with a square of a quarter of the area half-way over one corner hide, seen from
 * all points of both, a quarter of their factor: by the four turns about their axis each segment is blocked
 * by one of four such squares. */
static mesh quartered_plates(void) {
    mesh m = {0};
    mesh_add_quad(&m, (const double[4][3]){{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
    mesh_add_quad(&m, (const double[4][3]){{0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}});
    mesh_add_quad(&m, (const double[4][3]){{0, 0, .5}, {.5, 0, .5}, {.5, .5, .5}, {0, .5, .5}});
    mesh_finish(&m, .5f);
    return m;
}

/* Over SEEDS seeds the mean of the visible part is 3/4 of the factor, within five of its standard errors by
 * their spread, and the spread is what was asked for: the law of the error is kept within a factor of 2. */
START_TEST(segments_are_unbiased_and_as_exact_as_asked) {
    enum { SEEDS = 200 };
    const double accuracies[] = {3e-2, 5e-3, 1e-3}, accuracy = accuracies[_i];
    mesh m = quartered_plates();
    lam_error error = {.message = ""};
    visibility *v;
    polygon polygons[3];
    pair_factor_rules rules;
    ck_ok(visibility_create(&m, &v, &error));
    for (size_t i = 0; i < m.n; i++) polygon_of_element(&m, i, &polygons[i]);
    pair_factor_rules_init(&rules);
    const double g = pair_factor_exchange(&rules, &polygons[0], &polygons[1], 1e-8);
    double sum = 0, squares = 0;
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        const occlusion o = {.v = v,
                             .area = m.area,
                             .polygons = polygons,
                             .rules = &rules,
                             .tolerance = 1e-8,
                             .accuracy = accuracy,
                             .segments = VISIBILITY_PACKET,
                             .seed = seed};
        const double off = occlusion_estimate(&o, NULL, 0, 1, g) - .75 * g;
        sum += off;
        squares += off * off;
    }
    /* F of the visible part is above .1: see occlusion_estimate. */
    const double spread = sqrt(squares / SEEDS), asked = 10 * .75 * g * accuracy;
    ck_assert_double_le(fabs(sum / SEEDS), 5 * spread / sqrt(SEEDS));
    ck_assert_double_le(spread, 2 * asked);
    ck_assert_double_ge(spread, asked / 4);
    visibility_destroy(v);
    mesh_free(&m);
}
END_TEST

/* Two trapezoids of an atrium's columns that see each other at a grazing angle, a fifth of the segments
 * between them in front of both: their pieces lost .6 of the factor where all eight segments of a piece were
 * behind. Nothing stands between: all of the factor is visible, to the tolerance of the pieces. */
START_TEST(pieces_that_hardly_face_lose_nothing) {
    const double low[4][3] = {{4.3091, -.1909, 5.62},
                              {4.5, -.27, 5.62},
                              {4.5, -.2, 5.7},
                              {4.3586, -.1414, 5.7}},
                 high[4][3] = {{4.3, 0, 5.7}, {4.3586, -.1414, 5.7}, {4.3798, -.1202, 6.4}, {4.33, 0, 6.4}};
    const double tolerance = 1e-6;
    mesh m = {0};
    lam_error error = {.message = ""};
    visibility *v;
    polygon polygons[2];
    pair_factor_rules rules;
    mesh_add_quad(&m, low);
    mesh_add_quad(&m, high);
    mesh_finish(&m, .5f);
    ck_ok(visibility_create(&m, &v, &error));
    for (size_t i = 0; i < m.n; i++) polygon_of_element(&m, i, &polygons[i]);
    pair_factor_rules_init(&rules);
    const double g = pair_factor_exchange(&rules, &polygons[0], &polygons[1], tolerance);
    ck_assert_double_gt(g / m.area[0], 1e-3);
    for (uint64_t seed = 0; seed < 40; seed++) {
        const occlusion o = {.v = v,
                             .area = m.area,
                             .polygons = polygons,
                             .rules = &rules,
                             .tolerance = tolerance,
                             .accuracy = 3e-5,
                             .segments = VISIBILITY_PACKET,
                             .seed = seed};
        ck_assert_double_eq_tol(occlusion_estimate(&o, NULL, 0, 1, g), g, 1e-4 * g);
    }
    visibility_destroy(v);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("formfactor/pair_sampler");
    TCase *cases = tcase_create("pair_sampler");
    suite_add_tcase(suite, cases);
    tcase_set_timeout(cases, 60);
    tcase_add_test(cases, packets_are_places);
    tcase_add_loop_test(cases, powers_of_two_are_even, 0, 5);
    tcase_add_loop_test(cases, all_dimensions_together_are_even, 0, 5);
    tcase_add_loop_test(cases, points_of_pairs_are_independent, 0, 3);
    tcase_add_loop_test(cases, segments_are_unbiased_and_as_exact_as_asked, 0, 3);
    tcase_add_test(cases, pieces_that_hardly_face_lose_nothing);
    return suite_run_together(suite);
}
