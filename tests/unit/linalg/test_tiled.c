/* Sparse rows in tiles: groups of one to three, empty and long ones, against double, and the same bits in any
 * batch. */
#include "solver/base/half.h"
#include "solver/base/random.h"
#include "solver/linalg/tiled.h"
#include "support/dense.h"
#include "support/suite.h"

#include <float.h>

enum { N = 700, VECTORS = 16 };

static lam_error error;

/* Rows of 0 to 20 numbers, some of up to 300, alone or in runs. */
static csr random_rows(float scale, uint64_t *state) {
    csr a = {.n = N,
             .indptr = test_allocate(N + 1, sizeof *a.indptr),
             .indices = test_allocate(N * N, sizeof *a.indices),
             .data = test_allocate(N * N, sizeof *a.data)};
    for (size_t i = 0; i < N; i++) {
        const size_t most = i % 50 == 7 ? 300 : i % 3 == 0 ? 0 : 20;
        const double share = random_lcg_unit(state) * (double)most / N;
        uint64_t last = a.indptr[i];
        for (size_t j = 0; j < N && most > 0; j++) {
            const bool follows = last > a.indptr[i] && a.indices[last - 1] + 1 == j;
            if (random_lcg_unit(state) > (follows ? .5 : share) && !(i == 1 && j == N - 1)) continue;
            a.indices[last] = (uint32_t)j;
            a.data[last++] = scale * float_of_half(half_of_float((float)(random_lcg_unit(state) - .3)));
        }
        a.indptr[i + 1] = last;
    }
    return a;
}

/* Groups of one to three; the last has one row. Returns their number. */
static size_t random_groups(uint32_t *first, uint64_t *state) {
    size_t n_groups = 0, end = 0;
    while (end < N) {
        const size_t most = 1 + (size_t)(3 * random_lcg_unit(state)), left = N - 1 - end;
        first[n_groups++] = (uint32_t)end;
        end += left == 0 ? 1 : most < left ? most : left;
    }
    first[n_groups] = N;
    return n_groups;
}

static void check_against_double(const csr *a, const float *X, const float *Y) {
    for (size_t v = 0; v < VECTORS; v++)
        for (size_t i = 0; i < N; i++) {
            double sum = 0, size = 0;
            for (uint64_t e = a->indptr[i]; e < a->indptr[i + 1]; e++) {
                const double product = (double)a->data[e] * (double)X[v * N + a->indices[e]];
                sum += product;
                size += fabs(product);
            }
            /* A product is rounded when it is made, with its lane's sum (of at most a fourth of N/3 tiles
             * that may be left alone), and in four sums of lanes. */
            ck_assert(fabs((double)Y[v * N + i] - sum) <= (N / 4 + 5) * (FLT_EPSILON / 2) * size);
        }
}

START_TEST(products_are_right_and_do_not_depend_on_the_batch) {
    static const float scales[] = {1, 0x1p-9f};
    uint64_t state = 3;
    csr a = random_rows(scales[_i], &state);
    tiled_rows t;
    uint32_t first[N + 1], rows[40];
    float *X = test_allocate(VECTORS * N + TILED_PAST, sizeof *X), *one = test_allocate(N, sizeof *one),
          *Y = test_allocate(VECTORS * N, sizeof *Y);
    float *work = aligned_alloc(64, (tiled_work(N, VECTORS) + 16) * sizeof *work);
    const size_t n_groups = random_groups(first, &state);
    ck_ok(tiled_create(&a, scales[_i], n_groups, first, &t, &error));
    for (size_t k = 0; k < VECTORS * N; k++) X[k] = (float)(random_lcg_unit(&state) - .4);
    for (size_t k = 0; k < TILED_PAST; k++) X[VECTORS * N + k] = 1e30f;
    for (size_t m = 1; m <= VECTORS; m += 5)
        for (size_t n_threads = 1; n_threads < 4; n_threads += 2) {
            for (size_t k = 0; k < VECTORS * N; k++) Y[k] = NAN;
            tiled_multiply(&t, m, X, Y, work, n_threads);
            for (size_t v = 0; v < m; v++) {
                tiled_multiply(&t, 1, X + v * N, one, work, 1);
                ck_assert_mem_eq(one, Y + v * N, N * sizeof *one);
            }
        }
    check_against_double(&a, X, Y);
    for (size_t k = 0; k < 40; k++) rows[k] = (uint32_t)(k * 17 + 7 * (k % 3));
    tiled_multiply(&t, 1, X, one, work, 1);
    for (size_t i = 0; i < N; i++) Y[i] = NAN;
    tiled_multiply_rows(&t, 40, rows, X, Y);
    for (size_t k = 0; k < 40; k++) ck_assert_float_eq(Y[rows[k]], one[rows[k]]);
    tiled_free(&t);
    csr_free(&a);
    free(X);
    free(Y);
    free(one);
    free(work);
}
END_TEST

START_TEST(rows_are_stored_in_tiles) {
    /* Rows 0 to 2 and 3 to 4; entries in columns 0 and 4 of row 1, and 4 of row 3. */
    uint64_t indptr[] = {0, 0, 2, 2, 3, 3};
    uint32_t indices[] = {0, 4, 4};
    float data[] = {.5f, 2, 3};
    const uint32_t first[] = {0, 3, 5}, high[] = {0, 4, 5}, short_of[] = {0, 3};
    const csr a = {.n = 5, .indptr = indptr, .indices = indices, .data = data};
    tiled_rows t;
    ck_ok(tiled_create(&a, .5f, 2, first, &t, &error));
    ck_assert_uint_eq(t.begin[1], 1);
    ck_assert_uint_eq(t.begin[2], 2);
    ck_assert_uint_eq(t.columns[0], 0);
    ck_assert_uint_eq(t.columns[1], 3);
    ck_assert_uint_eq(t.columns[4], 3);
    for (size_t k = 0; k < 2 * TILE * TILE_LANES; k++) {
        const float wanted = k == TILE_LANES ? 1 : k == TILE_LANES + TILE + 1 ? 4 : k == 37 ? 6 : 0;
        ck_assert_float_eq(float_of_half(t.values[k]), wanted);
    }
    tiled_free(&t);
    ck_assert(tiled_create(&a, .3f, 2, first, &t, &error) == LAM_ERR_ARGUMENT);
    ck_assert(tiled_create(&a, .5f, 2, high, &t, &error) == LAM_ERR_ARGUMENT);
    ck_assert(tiled_create(&a, .5f, 1, short_of, &t, &error) == LAM_ERR_ARGUMENT);
    data[1] = 1 + 0x1p-20f;
    ck_assert(tiled_create(&a, .5f, 2, first, &t, &error) == LAM_ERR_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(error.message, "entry 1 = 1.00000095, must be 0.5 times"));
}
END_TEST

int main(void) {
    Suite *suite = suite_create("rows in tiles");
    TCase *tests = tcase_create("products");
    tcase_add_loop_test(tests, products_are_right_and_do_not_depend_on_the_batch, 0, 2);
    tcase_add_test(tests, rows_are_stored_in_tiles);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
