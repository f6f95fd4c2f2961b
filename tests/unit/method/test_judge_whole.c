/* The errors of whole groups, alone and together, against sums by hand: four elements of two bins, two
 * channels, three groups lit. And which groups are lit. */
#include "solver/method/judge/judge_probes.h"
#include "solver/method/judge/judge_whole.h"
#include "solver/operator/operator.h"
#include "support/box.h"
#include "support/suite.h"

#include "store/status.h"

#include <stdlib.h>
#include <string.h>

enum { N = 4, C = 2, GROUPS = 2, VECTOR = C * N, LIT = 3 };
static const double area[N] = {1, 2, 4, 3};
static const float reflectance[VECTOR] = {.5f, .5f, .5f, .5f, .5f, .5f, .5f, .5f};
static const uint32_t group[N] = {0, 1, 0, 1};
static const build_problem problem = {.n = N, .n_channels = C, .area = area, .reflectance = reflectance};

/* Corrections by twins: x has the noise t, y has -t. The noise of the last one is more than a third of it. */
static double off_of(size_t v, size_t k) {
    return .1 * (double)((3 * k + 5 * v + k * v) % 7) - .2;
}

static double noise_of(size_t v, size_t k) {
    return (v == LIT - 1 ? .9 : .02) * (double)((2 * k + v) % 3) - .01;
}

/* Noise beside that of the twins, such as that of the first light. */
static double light_of(size_t v, size_t k) {
    return .003 * (double)((k + 2 * v) % 4);
}

/* The mean product over the elements of a bin, or of the means of the bin, of errors, or of the noise in
 * them: both sorts of noise are independent of each other, and one number in a mean. */
static double product(size_t bin, size_t v, size_t w, bool of_means, bool of_noise) {
    double sum = 0, all = 0;
    for (size_t i = 0; i < N; i++) all += group[i] == bin ? area[i] : 0;
    for (size_t c = 0; c < C; c++) {
        double a = 0, b = 0;
        for (size_t i = 0; i < N; i++) {
            const size_t k = c * N + i;
            if (group[i] != bin) continue;
            sum += of_means ? 0
                   : of_noise
                       ? area[i] * (noise_of(v, k) * noise_of(w, k) + light_of(v, k) * light_of(w, k)) / all
                       : area[i] * off_of(v, k) * off_of(w, k) / all;
            a += area[i] / all * (of_noise ? noise_of(v, k) + light_of(v, k) : off_of(v, k));
            b += area[i] / all * (of_noise ? noise_of(w, k) + light_of(w, k) : off_of(w, k));
        }
        if (of_means) sum += a * b;
    }
    return sum;
}

static double expected(size_t bin, size_t v, size_t w, bool of_means) {
    double noise = product(bin, v, w, of_means, true);
    for (size_t k = 0; k < 2; k++) {
        const size_t u = k == 0 ? v : w;
        const double all = product(bin, u, u, of_means, false), in = product(bin, u, u, of_means, true);
        if (!(in <= (all - in) / 9)) noise = 0;
    }
    return product(bin, v, w, of_means, false) - noise;
}

START_TEST(groups_are_off_alone_and_together) {
    const judge_input input = {.problem = &problem, .group = group, .n_groups = GROUPS};
    const float E[VECTOR] = {0}, B[VECTOR] = {0};
    const uint32_t groups[LIT] = {1, 0, 1};
    double x[LIT][VECTOR], y[LIT][VECTOR], light[LIT][VECTOR];
    figure_probe each[LIT];
    by_group_sums bins = {.n = 0};
    group_errors made = {.n_groups = GROUPS, .n_rows = 1};
    lam_error error = {.message = ""};
    for (size_t v = 0; v < LIT; v++) {
        for (size_t k = 0; k < VECTOR; k++) {
            x[v][k] = off_of(v, k) + noise_of(v, k);
            y[v][k] = off_of(v, k) - noise_of(v, k);
            light[v][k] = light_of(v, k);
        }
        each[v] = (figure_probe){.problem = &problem,
                                 .E = E,
                                 .B = B,
                                 .x = x[v],
                                 .y = y[v],
                                 .noise = light[v],
                                 .relation = REFERENCE_TWIN};
    }
    ck_ok(by_group_begin(&input, LIT, &bins, &error));
    ck_ok(whole_errors(LIT, each, groups, &bins, &made, &error));
    ck_assert_uint_eq(made.n_whole, LIT);
    ck_assert_int_eq(memcmp(made.whole_groups, groups, sizeof groups), 0);
    for (size_t b = 0; b < GROUPS; b++)
        for (size_t v = 0; v < LIT; v++)
            for (size_t w = 0; w < LIT; w++) {
                const size_t at = (b * LIT + v) * LIT + w;
                ck_assert_double_eq_tol(made.whole_rms[at], expected(b, v, w, false), 1e-14);
                ck_assert_double_eq_tol(made.whole_mean[at], expected(b, v, w, true), 1e-14);
            }
    group_errors_free(&made);
    by_group_free(&bins);
}
END_TEST

/* Of six groups, the sides of a box, two have lamps, and all differ in size but for pairs. */
START_TEST(bright_groups_come_first_and_then_large_ones) {
    enum { SIDE = 2, ELEMENTS = 6 * SIDE * SIDE, SIDES = 6 };
    const double size[3] = {10, 6, 3};
    mesh m = box_mesh(size, SIDE, .5f);
    float emission[ELEMENTS] = {0}, emits[ELEMENTS] = {0}, rho[ELEMENTS];
    uint32_t side[ELEMENTS];
    lam_operator *op = NULL;
    lam_error error = {.message = ""};
    float *P = memory_allocate(ELEMENTS, ELEMENTS * sizeof *P, "operator", &error);
    ck_assert_ptr_nonnull(P);
    for (size_t i = 0; i < ELEMENTS; i++) {
        side[i] = (uint32_t)(i / (SIDE * SIDE));
        rho[i] = .5f;
        emission[i] = side[i] == 1;
        emits[i] = side[i] == 2 || side[i] == 5;
    }
    emission[0] = 1; /* of side 0, which is as large as side 1: less power than that of side 1 */
    ck_ok(operator_exact_create(ELEMENTS, 1, rho, P, &op, &error));
    const build_problem box = {.n = ELEMENTS, .n_channels = 1, .area = m.area, .reflectance = rho};
    for (int sources = 0; sources < 2; sources++) {
        probe_source s = {.deck = NULL};
        ck_ok(probe_source_make(&box, op, emission, sources ? emits : NULL, 1, 1, 1, &s, &error));
        ck_ok(probe_source_add_groups(&s, side, SIDES, NULL, 1, 64, &error));
        if (sources) {
            ck_assert_uint_eq(s.most[JUDGE_WHOLE], 2);
            ck_assert_uint_eq(s.whole[0], 5);
            ck_assert_uint_eq(s.whole[1], 2);
        } else {
            ck_assert_uint_eq(s.most[JUDGE_WHOLE], 3);
            ck_assert_uint_eq(s.whole[0], 1);
            ck_assert_uint_eq(s.whole[1], 0);
            for (size_t g = 0; g < SIDES; g++)
                ck_assert(s.whole[2] == g || s.whole[0] == g || s.whole[1] == g ||
                          m.area[s.whole[2] * SIDE * SIDE] >= m.area[g * SIDE * SIDE]);
        }
        probe_source_free(&s);
    }
    lam_operator_close(op);
    mesh_free(&m);
}
END_TEST

/* Four million numbers at once at most, and no more figures than stores take; never fewer than three groups.
 */
START_TEST(fewer_groups_where_they_are_many_or_large) {
    ck_assert_uint_eq(judge_whole_most(1000, 1, 10), 64);
    ck_assert_uint_eq(judge_whole_most(163687, 1, 10), 25);
    ck_assert_uint_eq(judge_whole_most(1000, 1, 1000), 8);
    ck_assert_uint_eq(judge_whole_most(10000000, 3, 10), 3);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("judge_whole");
    TCase *cases = tcase_create("judge_whole");
    tcase_add_test(cases, groups_are_off_alone_and_together);
    tcase_add_test(cases, bright_groups_come_first_and_then_large_ones);
    tcase_add_test(cases, fewer_groups_where_they_are_many_or_large);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
