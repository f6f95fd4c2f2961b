/* Sparse rows in slices: empty, short and long ones, against double, and the same bits in any batch. */
#include "solver/base/half.h"
#include "solver/base/random.h"
#include "solver/linalg/sliced.h"
#include "support/dense.h"
#include "support/suite.h"

#include <float.h>

enum { N = 700, VECTORS = 16 };

static lam_error error;

/* Rows of 0 to 20 numbers, some of up to 300, each length about as often as not a multiple of 16. */
static csr random_rows(uint64_t *state) {
    csr a = {.n = N,
             .indptr = test_allocate(N + 1, sizeof *a.indptr),
             .indices = test_allocate(N * N, sizeof *a.indices),
             .data = test_allocate(N * N, sizeof *a.data)};
    for (size_t i = 0; i < N; i++) {
        const size_t most = i % 50 == 7 ? 300 : i % 3 == 0 ? 0 : 20;
        const double share = random_lcg_unit(state) * (double)most / N;
        uint64_t last = a.indptr[i];
        for (size_t j = 0; j < N && most > 0; j++) {
            if (random_lcg_unit(state) > share) continue;
            a.indices[last] = (uint32_t)j;
            a.data[last++] = (float)(random_lcg_unit(state) - .3);
        }
        a.indptr[i + 1] = last;
    }
    return a;
}

/* None; powers of two, and what is none. */
static const float scales[] = {0, 1, 0x1p-9f, .3f};

START_TEST(products_are_right_and_do_not_depend_on_the_batch) {
    uint64_t state = 3;
    csr a = random_rows(&state);
    sliced_rows s;
    float *X = test_allocate(VECTORS * N, sizeof *X), *one = test_allocate(N, sizeof *one),
          *Y = test_allocate(VECTORS * N, sizeof *Y);
    float *work = aligned_alloc(64, (sliced_work(N, VECTORS) + 16) * sizeof *work);
    if (_i > 0)
        for (uint64_t e = 0; e < a.indptr[N]; e++)
            a.data[e] = scales[_i] * float_of_half(half_of_float(a.data[e] / scales[_i]));
    ck_ok(sliced_create(&a, scales[_i], &s, &error));
    ck_assert_int_eq(s.halves != NULL, _i == 1 || _i == 2);
    ck_assert_uint_gt(s.n_long, 3);
    ck_assert_uint_gt(s.n_slices, 20);
    ck_assert_uint_gt(s.n_empty, N / 4);
    for (size_t k = 0; k < VECTORS * N; k++) X[k] = (float)(random_lcg_unit(&state) - .4);
    for (size_t m = 1; m <= VECTORS; m += 5)
        for (size_t n_threads = 1; n_threads < 4; n_threads += 2) {
            for (size_t k = 0; k < VECTORS * N; k++) Y[k] = NAN;
            sliced_multiply(&s, m, X, Y, work, n_threads);
            for (size_t v = 0; v < m; v++) {
                sliced_multiply(&s, 1, X + v * N, one, work, 1);
                ck_assert_mem_eq(one, Y + v * N, N * sizeof *one);
            }
        }
    for (size_t v = 0; v < VECTORS; v++)
        for (size_t i = 0; i < N; i++) {
            double sum = 0, size = 0;
            for (uint64_t e = a.indptr[i]; e < a.indptr[i + 1]; e++) {
                const double product = (double)a.data[e] * (double)X[v * N + a.indices[e]];
                sum += product;
                size += fabs(product);
            }
            /* A product is rounded when it is made, with its turn's sum (at most 96 of them), and in four
             * pairs. */
            ck_assert(fabs((double)Y[v * N + i] - sum) <= 101 * (FLT_EPSILON / 2) * size);
        }
    /* In 16 bits and in 32 they are the same, and some rows are what they are among all. */
    sliced_rows wide;
    uint32_t rows[40];
    ck_ok(sliced_create(&a, 0, &wide, &error));
    sliced_multiply(&wide, 1, X, one, work, 1);
    sliced_multiply(&s, 1, X, Y, work, 1);
    ck_assert_mem_eq(one, Y, N * sizeof *one);
    for (size_t k = 0; k < 40; k++) rows[k] = (uint32_t)(k * 17 + 7 * (k % 3));
    for (size_t i = 0; i < N; i++) Y[i] = NAN;
    sliced_multiply_rows(&s, 40, rows, X, Y);
    for (size_t k = 0; k < 40; k++) ck_assert_float_eq(Y[rows[k]], one[rows[k]]);
    sliced_free(&wide);
    sliced_free(&s);
    csr_free(&a);
    free(X);
    free(Y);
    free(one);
    free(work);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("sliced rows");
    TCase *tests = tcase_create("products");
    tcase_add_loop_test(tests, products_are_right_and_do_not_depend_on_the_batch, 0,
                        sizeof scales / sizeof *scales);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
