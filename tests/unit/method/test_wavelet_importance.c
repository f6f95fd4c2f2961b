/* The hierarchical operator of elements of which some are read: what these err by, and what it costs. */
#include "solver/base/random.h"
#include "solver/method/reference.h"
#include "support/building.h"
#include "support/closed_box.h"
#include "support/dense.h"
#include "support/suite.h"

#include <math.h>

static lam_error error;

/* Where a fifth of a wall is read, its light errs no more than an operator of everything does, within a tenth
 * (they drop other coefficients), with half of the coefficients; elsewhere it is only roughly right:
 * thresholds of K are at most 16 times as large there, and what is dropped at most as much. */
START_TEST(what_is_read_is_as_good_for_fewer_coefficients) {
    closed_box s = closed_box_make(room, 14, .7f);
    const build_problem *problem = closed_box_problem(&s);
    const size_t n = problem->n, wall = n / 6;
    build_problem some = *problem;
    importance read = {.n = n, .read = test_allocate(n, sizeof(float))};
    float *E = test_allocate(4 * n, sizeof *E), *ones = test_allocate(n, sizeof *ones);
    uint64_t seed = 2;
    for (size_t i = 0; i < n; i++) ones[i] = 1;
    for (size_t i = 0; i < wall / 5; i++) read.read[i] = 1;
    const factor_product F = factor_product_of_rows(problem->F);
    ck_ok(importance_find(&F, 1, problem->reflectance, problem->area, &read, &error));
    some.importance = &read;
    E[n / 2] = E[n + n - 1] = 1;
    for (size_t i = 0; i < n; i++) {
        E[2 * n + i] = i > n / 2 && i < n / 2 + 40 ? 1 : 0;
        E[3 * n + i] = (float)random_lcg_unit(&seed);
    }
    build_report report;
    operator_description about[2];
    lam_operator *all = hierarchical_good(problem, .02, &report),
                 *part = hierarchical_good(&some, .02, &report);
    operator_describe(all, &about[0]);
    operator_describe(part, &about[1]);
    ck_assert_double_lt(about[1].density, .5 * about[0].density);
    double errors[2] = {0, 0};
    for (int light = 0; light < 4; light++) {
        errors[0] += indirect_error(problem, all, read.read, E + light * n);
        errors[1] += indirect_error(problem, part, read.read, E + light * n);
        const double whole = indirect_error(problem, all, ones, E + light * n);
        const double rough = indirect_error(problem, part, ones, E + light * n);
        ck_assert_double_lt(rough, 16 * whole);
        ck_assert_double_gt(rough, whole);
    }
    ck_assert_double_gt(errors[0], 0);
    ck_assert_double_lt(errors[1], 1.1 * errors[0]);
    lam_operator_close(all);
    lam_operator_close(part);
    importance_free(&read);
    free(E);
    free(ones);
    closed_box_free(&s);
}
END_TEST

/* S is symmetric: where elements alone emit, the operator is that of the same elements as receivers, with y =
 * z. Where a fifth of a wall emits and a fifth of the opposite one is read, light from the one on the other
 * errs no more than an operator of everything does, within a tenth, with fewer coefficients than for the
 * receivers. */
START_TEST(light_of_sources_is_as_good_for_fewer_coefficients) {
    closed_box s = closed_box_make(room, 14, .7f);
    const build_problem *problem = closed_box_problem(&s);
    const size_t n = problem->n, wall = n / 6;
    build_problem some = *problem;
    importance read = {.n = n, .read = test_allocate(n, sizeof(float))},
               emits = {.n = n, .emits = test_allocate(n, sizeof(float))},
               same = {.n = n, .emits = test_allocate(n, sizeof(float))}, both = {.n = n};
    float *E = test_allocate(n, sizeof *E);
    for (size_t i = 0; i < wall / 5; i++) read.read[i] = same.emits[i] = emits.emits[n - 1 - i] = 1;
    for (size_t i = 0; i < n; i++) E[i] = emits.emits[i] * (float)(1 + i % 3);
    const factor_product F = factor_product_of_rows(problem->F);
    both.read = read.read;
    both.emits = emits.emits;
    importance *const all[] = {NULL, &read, &same, &both};
    double density[4], error_of[4];
    for (int k = 0; k < 4; k++) {
        build_report report;
        operator_description about;
        if (k > 0) ck_ok(importance_find(&F, 1, problem->reflectance, problem->area, all[k], &error));
        some.importance = all[k];
        lam_operator *op = hierarchical_good(&some, .02, &report);
        operator_describe(op, &about);
        density[k] = about.density;
        error_of[k] = indirect_error(problem, op, read.read, E);
        lam_operator_close(op);
    }
    ck_assert_double_eq(density[2], density[1]);
    ck_assert_double_lt(density[3], .8 * density[1]);
    ck_assert_double_gt(error_of[0], 0);
    ck_assert_double_lt(error_of[3], 1.1 * error_of[0]);
    both.read = both.emits = NULL;
    importance_free(&read);
    importance_free(&emits);
    importance_free(&same);
    importance_free(&both);
    free(E);
    closed_box_free(&s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("wavelet importance");
    TCase *cases = tcase_create("wavelet importance");
    tcase_set_timeout(cases, 120);
    tcase_add_test(cases, what_is_read_is_as_good_for_fewer_coefficients);
    tcase_add_test(cases, light_of_sources_is_as_good_for_fewer_coefficients);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
