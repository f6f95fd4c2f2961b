/* Counts of singular values, against all of them by LAPACK. */
#include "solver/method/low_rank/spectrum.h"
#include "support/subject.h"

/* Pairs of elements that see only each other, by .25: half the eigenvalues are .25, half -.25. */
START_TEST(two_steps_find_two_values) {
    enum { N = 300 };
    lam_error error = {0};
    uint64_t indptr[N + 1] = {0};
    uint32_t indices[N], order[N];
    float data[N];
    double area[N];
    for (uint32_t i = 0; i < N; i++) {
        indptr[i + 1] = i + 1;
        indices[i] = i ^ 1u;
        data[i] = .25f;
        area[i] = 1 + i / 2;
        order[i] = i;
    }
    const csr F = {.n = N, .indptr = indptr, .indices = indices, .data = data};
    row_source rows;
    scaled_matrix S = {0};
    spectrum s = {0};
    row_source_of_csr(&rows, &F);
    ck_assert_int_eq(scaled_init(&S, &rows, area, order, &error), LAM_OK);
    ck_assert_msg(spectrum_find(&S, 40, 1, NULL, &s, &error) == LAM_OK, "%s", error.message);
    ck_assert_double_eq_tol(spectrum_above(&s, .2499), N, 1e-3);
    ck_assert_double_eq_tol(spectrum_above(&s, .2501), 0, 1e-3);
    ck_assert_double_eq_tol(spectrum_tail(&s, .2), 0, 1e-6);
    ck_assert_double_eq_tol(spectrum_tail(&s, .3), 1, 1e-6);
    spectrum_free(&s);
    scaled_free(&S);
}
END_TEST

/* The trace of a function of S by eight Gaussian vectors is off by sqrt(2 tr f^2 / 8), three of which are
 * allowed; a rule of 40 nodes smears a step over about a fortieth of the range, .05 of [-1, 1]: the count is
 * between those a bit to either side. */
START_TEST(counts_are_right) {
    static const double levels[] = {.03, .06, .1, .2, .4};
    lam_error error = {0};
    subject s;
    spectrum found = {0};
    subject_make(&s, room, 9);
    const size_t n = s.S.n;
    double *values = values_of_difference(&s.S, NULL);
    ck_assert_msg(spectrum_find(&s.S, 40, 1, NULL, &found, &error) == LAM_OK, "%s", error.message);
    double all = 0;
    for (size_t i = 0; i < n; i++) all += values[i] * values[i];
    for (size_t k = 0; k < sizeof levels / sizeof *levels; k++) {
        size_t low = 0, high = 0;
        double tail = 0;
        for (size_t i = 0; i < n; i++) {
            low += values[i] > levels[k] + .025;
            high += values[i] > levels[k] - .025;
            if (values[i] <= levels[k]) tail += values[i] * values[i] / all;
        }
        const double count = spectrum_above(&found, levels[k]);
        printf("above %.2f: %.1f, truly %zu to %zu; tail %.4f, truly %.4f\n", levels[k], count, low, high,
               spectrum_tail(&found, levels[k]), tail);
        ck_assert_double_le(count, (double)high + 3 * sqrt((double)high / 4) + 1);
        ck_assert_double_ge(count, (double)low - 3 * sqrt((double)low / 4) - 1);
        ck_assert_double_eq_tol(spectrum_tail(&found, levels[k]), tail, .1);
    }
    spectrum_free(&found);
    free(values);
    subject_free(&s);
}
END_TEST

START_TEST(nothing_seen_is_no_rank) {
    uint64_t indptr[5] = {0};
    const uint32_t order[4] = {0, 1, 2, 3};
    const double area[4] = {1, 1, 1, 1};
    uint32_t no_index = 0;
    float no_data = 0;
    const csr F = {.n = 4, .indptr = indptr, .indices = &no_index, .data = &no_data};
    lam_error error = {0};
    row_source rows;
    scaled_matrix S = {0};
    spectrum s = {0};
    row_source_of_csr(&rows, &F);
    ck_assert_int_eq(scaled_init(&S, &rows, area, order, &error), LAM_OK);
    ck_assert_msg(spectrum_find(&S, 40, 1, NULL, &s, &error) == LAM_OK, "%s", error.message);
    ck_assert_double_eq(spectrum_above(&s, .01), 0);
    ck_assert_double_eq(spectrum_tail(&s, .01), 0);
    spectrum_free(&s);
    scaled_free(&S);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("spectrum");
    TCase *cases = tcase_create("counts");
    tcase_set_timeout(cases, 120);
    tcase_add_test(cases, two_steps_find_two_values);
    tcase_add_test(cases, counts_are_right);
    tcase_add_test(cases, nothing_seen_is_no_rank);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
