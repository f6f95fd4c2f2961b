/* Every factorizer against a dense SVD in double: the bound, the rank, the basis. */
#include "support/subject.h"

static const char *const names[] = {"hf", "svd", "rsi", "sgrsvd"};
enum { NAMES = sizeof names / sizeof *names };

START_TEST(every_factorizer_keeps_its_bound) {
    subject s;
    subject_make(&s, room, 5);
    const double epsilons[] = {.3, .1, .02};
    for (int e = 0; e < 3; e++) {
        const factorizer_options options = {
            .epsilon = epsilons[e], .budget = {.alpha = .5}, .levels = -1, .iterations = -1, .seed = 5};
        tall_factors f = factors_of(&s, names[_i], &options, NULL);
        ck_assert_double_le(norm_of_difference(&s.S, &f), epsilons[e] + 2e-6);
        check_orthonormal(&f);
        tall_factors_free(&f);
    }
    subject_free(&s);
}
END_TEST

START_TEST(fixed_rank_is_exact) {
    subject s;
    subject_make(&s, unit_cube, 4); /* 96 elements */
    double *values = values_of_difference(&s.S, NULL);
    const size_t ranks[] = {1, 7, 50, 96, 1000};
    for (int k = 0; k < 5; k++) {
        const factorizer_options options = {
            .rank = ranks[k], .budget = {.alpha = .5}, .levels = 2, .iterations = -1, .seed = 5};
        factorizer_report report;
        tall_factors f = factors_of(&s, names[_i], &options, &report);
        const double norm = norm_of_difference(&s.S, &f);
        ck_assert_uint_eq(f.rank, ranks[k] < 96 ? ranks[k] : 96);
        /* Never better than the best (Eckart and Young), and not far from it. */
        const double best = f.rank < 96 ? values[f.rank] : 0;
        ck_assert_double_ge(norm, best - 2e-6);
        ck_assert_msg(norm <= 3 * best + 5e-6, "%s, rank %zu: %g, best %g", names[_i], f.rank, norm, best);
        ck_assert_double_ge(report.passes, 1);
        tall_factors_free(&f);
    }
    free(values);
    subject_free(&s);
}
END_TEST

/* Nothing sees anything; one element; the same element many times. */
START_TEST(odd_matrices) {
    lam_error error = {0};
    enum { N = 40 };
    static uint64_t none[N + 1];
    uint32_t order[N];
    double area[N];
    for (uint32_t i = 0; i < N; i++) {
        order[i] = i;
        area[i] = pow(10, (double)i / 5); /* eight decades */
    }
    for (size_t n = 1; n <= N; n += N - 1) {
        csr F = {.n = n, .indptr = none};
        row_source rows;
        scaled_matrix S;
        row_source_of_csr(&rows, &F);
        ck_assert_int_eq(scaled_init(&S, &rows, area, order, &error), LAM_OK);
        for (int rank = 0; rank <= 3; rank += 3) {
            const factorizer_options options = {
                .epsilon = .1, .rank = (size_t)rank, .budget = {.alpha = .5}, .levels = -1, .iterations = -1};
            tall_factors f = {0};
            factorizer_report report;
            ck_assert_msg(factorize(names[_i], &S, &options, &f, &report, &error) == LAM_OK, "%s: %s",
                          names[_i], error.message);
            ck_assert_uint_eq(f.rank, rank == 0 ? 0 : n < 3 ? n : 3);
            for (size_t k = 0; k < n * f.rank; k++) ck_assert_float_eq(f.Q[k], 0);
            for (size_t k = 0; k < n * f.rank; k++) ck_assert(isfinite(f.V[k]));
            tall_factors_free(&f);
        }
        scaled_free(&S);
    }
}
END_TEST

START_TEST(norms_never_pass_one) {
    subject s;
    subject_make(&s, unit_cube, 5); /* closed: |S| = 1 */
    for (size_t rank = 1; rank <= 150; rank = 3 * rank + 1) {
        const factorizer_options options = {
            .rank = rank, .budget = {.alpha = .5}, .levels = 2, .iterations = 0, .seed = 11};
        tall_factors f = factors_of(&s, names[_i], &options, NULL);
        double *largest = calloc(f.rank, sizeof *largest);
        for (size_t c = 0; c < f.rank; c++) {
            double sum = 0;
            for (size_t i = 0; i < f.n; i++) sum += (double)f.Q[i * f.rank + c] * (double)f.Q[i * f.rank + c];
            /* Columns of Q are orthogonal: each is a singular value of Q V^T. */
            ck_assert_double_le(sqrt(sum), 1 + 1e-5);
        }
        free(largest);
        tall_factors_free(&f);
    }
    subject_free(&s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("factorizers");
    TCase *cases = tcase_create("factorizers");
    tcase_set_timeout(cases, 300);
    tcase_add_loop_test(cases, every_factorizer_keeps_its_bound, 0, NAMES);
    tcase_add_loop_test(cases, fixed_rank_is_exact, 0, NAMES);
    tcase_add_loop_test(cases, odd_matrices, 0, NAMES);
    tcase_add_loop_test(cases, norms_never_pass_one, 0, NAMES);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
