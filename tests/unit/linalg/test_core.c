/* The k x k core: inverse, condition, and what it refuses. */
#include "solver/base/random.h"
#include "solver/linalg/core.h"
#include "support/suite.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

static uint64_t random_state = 5;

static double random_double(void) {
    return random_lcg_unit(&random_state) - 0.5;
}

static lam_error error;

START_TEST(inverse_times_matrix_is_the_identity) {
    size_t k = 57;
    double *K = malloc(k * k * sizeof *K), *copy = malloc(k * k * sizeof *copy), rcond = -1;
    for (size_t j = 0; j < k * k; j++) copy[j] = K[j] = random_double() + (j % (k + 1) == 0 ? 4.0 : 0.0);
    ck_assert_msg(core_invert(k, K, &rcond, &error) == LAM_OK, "%s", error.message);
    ck_assert(rcond > 0 && rcond <= 1);
    /* Higham 14.2: |X K - I| <= c k u |X||L||U|, with |K||X| about 1/rcond; 8 k^2 u / rcond is well above. */
    double tolerance = 8.0 * (double)(k * k) * DBL_EPSILON / rcond;
    for (size_t i = 0; i < k; i++)
        for (size_t j = 0; j < k; j++) {
            double sum = 0;
            for (size_t l = 0; l < k; l++) sum += copy[i * k + l] * K[l * k + j];
            ck_assert_double_le(fabs(sum - (i == j ? 1.0 : 0.0)), tolerance);
        }
    free(K);
    free(copy);
}
END_TEST

/* Not symmetric, so that a transpose or the wrong norm shows. */
START_TEST(condition_is_in_the_1_norm_and_rows_stay_rows) {
    double K[4] = {1, 10, 0, 1}, rcond = 0;
    ck_assert(core_invert(2, K, &rcond, &error) == LAM_OK);
    ck_assert_double_eq(K[0], 1);
    ck_assert_double_eq(K[1], -10);
    ck_assert_double_eq(K[2], 0);
    ck_assert_double_eq(K[3], 1);
    /* |K|_1 = |K^-1|_1 = 11; the estimate is exact for so small a matrix, up to some roundings. */
    ck_assert_double_le(fabs(rcond - 1.0 / 121.0), 4 * DBL_EPSILON / 121.0);
    /* L^-1 = {1, 0, .4, -.2}: 1-norms 5 and 1.4, infinity-norms 7 and 1. */
    double L[4] = {1, 0, 2, -5}, norm = 5, inverse_norm = 1.4;
    ck_assert(core_invert(2, L, &rcond, &error) == LAM_OK);
    ck_assert_double_le(fabs(rcond - 1.0 / (norm * inverse_norm)), 4 * DBL_EPSILON);
}
END_TEST

START_TEST(an_empty_core_is_fine) {
    double K = 3, rcond = 0;
    ck_assert(core_invert(0, &K, &rcond, &error) == LAM_OK);
    ck_assert_double_eq(rcond, 1);
    ck_assert_double_eq(K, 3);
    float nothing = 3;
    ck_assert(core_factored(0, 1, &nothing, &nothing, &nothing, &nothing, &rcond, &error) == LAM_OK);
    ck_assert_float_eq(nothing, 3);
}
END_TEST

static void check_refused(size_t k, double *K, const char *word) {
    double rcond = 77;
    ck_assert(core_invert(k, K, &rcond, &error) == LAM_ERR_NUMERIC);
    ck_assert_msg(strstr(error.message, word) != NULL, "no '%s' in: %s", word, error.message);
    ck_assert_double_eq(rcond, 77);
}

START_TEST(cores_that_cannot_be_inverted_are_refused) {
    double singular[4] = {1, 2, 2, 4}, zero[1] = {0}, nearly[4] = {1, 0, 0, 1e-13}, nan[4] = {1, NAN, 0, 1};
    double infinite[4] = {1, 0, 0, INFINITY}, passes[4] = {1, 0, 0, 1e-11}, rcond = 0;
    check_refused(2, singular, "epsilon");
    check_refused(1, zero, "rcond = 0");
    check_refused(2, nearly, "rcond = 1e-13, must be at least 1e-12");
    check_refused(2, nan, "not finite");
    check_refused(2, infinite, "not finite");
    ck_assert(core_invert(2, passes, &rcond, &error) == LAM_OK);
    ck_assert(core_invert((size_t)1 << 31, passes, &rcond, &error) == LAM_ERR_ARGUMENT);
    ck_assert(core_factored((size_t)1 << 31, 1, NULL, NULL, NULL, NULL, &rcond, &error) == LAM_ERR_ARGUMENT);
}
END_TEST

START_TEST(factored_core_solves_its_equation) {
    size_t k = 9, n = 1100; /* three panels of rows */
    float *U = malloc(n * k * sizeof *U), *V = malloc(n * k * sizeof *V), *rho = malloc(n * sizeof *rho);
    float *core = malloc(k * k * sizeof *core);
    double *K = calloc(k * k, sizeof *K), rcond = 0;
    for (size_t j = 0; j < n * k; j++) {
        U[j] = (float)random_double() * 0.1f;
        V[j] = (float)random_double() * 0.1f;
    }
    for (size_t i = 0; i < n; i++) rho[i] = i % 7 == 0 ? 0.0f : (float)(0.5 + 0.9 * random_double());
    ck_assert_msg(core_factored(k, n, V, U, rho, core, &rcond, &error) == LAM_OK, "%s", error.message);
    for (size_t a = 0; a < k; a++) {
        K[a * k + a] = 1;
        for (size_t b = 0; b < k; b++)
            for (size_t i = 0; i < n; i++)
                K[a * k + b] -= (double)V[i * k + a] * (double)rho[i] * (double)U[i * k + b];
    }
    /* core is a rounded inverse: each term of K core is off by u |K||core|, everything else is in double. */
    for (size_t a = 0; a < k; a++)
        for (size_t b = 0; b < k; b++) {
            double sum = 0, magnitude = 0;
            for (size_t l = 0; l < k; l++) {
                sum += K[a * k + l] * (double)core[l * k + b];
                magnitude += fabs(K[a * k + l] * (double)core[l * k + b]);
            }
            ck_assert_double_le(fabs(sum - (a == b ? 1.0 : 0.0)),
                                FLT_EPSILON / 2 * magnitude + 1e-12 / rcond);
        }
    free(U);
    free(V);
    free(rho);
    free(core);
    free(K);
}
END_TEST

START_TEST(a_factored_core_that_is_singular_is_refused) {
    float U = 1, V = 2, rho = 0.5f, core = 33; /* 1 - 2 * .5 * 1 = 0 */
    double rcond = 77;
    ck_assert(core_factored(1, 1, &V, &U, &rho, &core, &rcond, &error) == LAM_ERR_NUMERIC);
    ck_assert_float_eq(core, 33);
    ck_assert_double_eq(rcond, 77);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("core");
    TCase *tests = tcase_create("core");
    tcase_set_timeout(tests, 120);
    tcase_add_test(tests, inverse_times_matrix_is_the_identity);
    tcase_add_test(tests, condition_is_in_the_1_norm_and_rows_stay_rows);
    tcase_add_test(tests, an_empty_core_is_fine);
    tcase_add_test(tests, cores_that_cannot_be_inverted_are_refused);
    tcase_add_test(tests, factored_core_solves_its_equation);
    tcase_add_test(tests, a_factored_core_that_is_singular_is_refused);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
