/* Coefficients of several lists as one matrix. */
#include "solver/base/random.h"
#include "solver/method/hierarchical/wavelet_entries.h"
#include "support/dense.h"
#include "support/suite.h"

enum { N = 97, EACH = 1500, LISTS_MOST = 4 };

static lam_error error;

/* Pairs are given in either order; one that several lists hold, or one list twice, stands there as often. */
START_TEST(lists_are_joined) {
    for (size_t n_lists = 1; n_lists <= LISTS_MOST; n_lists++) {
        uint64_t state = 5;
        coefficient_list lists[LISTS_MOST] = {{.list = NULL}};
        double *sums = test_allocate((size_t)N * N, sizeof *sums);
        size_t *times = test_allocate((size_t)N * N, sizeof *times);
        csr found;
        for (size_t k = 0; k < EACH; k++) {
            /* Rows from 60 on have none of their own; row 0 has many. */
            const uint32_t i = k % 5 == 0 ? 0 : (uint32_t)(random_lcg_unit(&state) * 60),
                           j = (uint32_t)(random_lcg_unit(&state) * N), low = i < j ? i : j,
                           high = i < j ? j : i;
            const float value = (float)(random_lcg_unit(&state) - .5);
            ck_ok(coefficient_list_add(&lists[k % n_lists], i, j, value, &error));
            sums[low * N + high] += (double)value;
            times[low * N + high]++;
        }
        ck_ok(coefficient_lists_join(N, lists, n_lists, &found, &error));
        ck_assert_uint_eq(found.indptr[0], 0);
        ck_assert_uint_eq(found.indptr[N], EACH);
        for (size_t i = 0; i < N; i++)
            for (uint64_t e = found.indptr[i]; e < found.indptr[i + 1]; e++) {
                const uint32_t j = found.indices[e];
                if (e > found.indptr[i]) ck_assert_uint_le(found.indices[e - 1], j);
                sums[i * N + j] -= (double)found.data[e];
                ck_assert_uint_gt(times[i * N + j]--, 0);
            }
        for (size_t k = 0; k < (size_t)N * N; k++) {
            ck_assert_uint_eq(times[k], 0);
            ck_assert_double_le(sums[k] < 0 ? -sums[k] : sums[k], 1e-14); /* sums of floats in double */
        }
        for (size_t l = 0; l < n_lists; l++) ck_assert(lists[l].list == NULL && lists[l].count == 0);
        csr_free(&found);
        free(sums);
        free(times);
    }
}
END_TEST

START_TEST(no_coefficients_are_a_matrix_too) {
    coefficient_list none[2] = {{.list = NULL}};
    csr found;
    ck_ok(coefficient_lists_join(3, none, 2, &found, &error));
    for (size_t i = 0; i <= 3; i++) ck_assert_uint_eq(found.indptr[i], 0);
    csr_free(&found);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("wavelet entries");
    TCase *tests = tcase_create("wavelet entries");
    tcase_add_test(tests, lists_are_joined);
    tcase_add_test(tests, no_coefficients_are_a_matrix_too);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
