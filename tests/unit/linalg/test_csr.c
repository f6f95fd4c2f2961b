/* Sparse rows: their product and what the check refuses. */
#include "solver/base/random.h"
#include "solver/linalg/csr.h"
#include "solver/linalg/csr_parts.h"
#include "solver/linalg/csr_rows.h"
#include "solver/linalg/sparse_product.h"
#include "support/suite.h"

#include <float.h>
#include <math.h>
#include <omp.h>
#include <string.h>

static uint64_t random_state = 9;

static double random_double(void) {
    return random_lcg_unit(&random_state) - 0.5;
}

/* About a third of the entries; every fifth row is empty. */
static csr random_rows(size_t n) {
    csr a = {.n = n,
             .indptr = malloc((n + 1) * sizeof *a.indptr),
             .indices = malloc(n * n * sizeof *a.indices),
             .data = malloc(n * n * sizeof *a.data)};
    uint64_t nnz = 0;
    a.indptr[0] = 0;
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < n && i % 5 != 4; j++)
            if (random_double() < -0.2) {
                a.indices[nnz] = (uint32_t)j;
                a.data[nnz++] = (float)random_double();
            }
        a.indptr[i + 1] = nnz;
    }
    return a;
}

/* The products are right in every instruction set and width, and a vector's bits are its own. */
START_TEST(products_of_floats_side_by_side) {
    enum { N = 83 };
    static const size_t widths[] = {1, 8, 16, 32};
    csr a = random_rows(N);
    float *X = aligned_alloc(64, N * CSR_FLOATS_WIDTH * sizeof *X), one[N], sums[CSR_FLOATS_WIDTH], alone;
    for (cpu_level set = CPU_PORTABLE; set <= cpu_best(); set++)
        for (size_t w = 0; w < 4; w++) {
            const size_t width = widths[w];
            ck_assert_uint_eq(csr_floats_width(width), width);
            ck_assert_uint_eq(csr_floats_width(width - width / 4), width);
            for (size_t j = 0; j < N * width; j++) X[j] = (float)random_double();
            for (size_t i = 0; i < N; i++) {
                const uint64_t first = a.indptr[i], count = a.indptr[i + 1] - first;
                csr_floats_row_of(set, width)(a.indices + first, a.data + first, count, X, sums);
                for (size_t v = 0; v < width; v++) {
                    double sum = 0, magnitude = 0;
                    for (size_t j = 0; j < N; j++) one[j] = X[j * width + v];
                    csr_floats_row_of(set, 1)(a.indices + first, a.data + first, count, one, &alone);
                    for (uint64_t e = first; e < first + count; e++) {
                        const double product = (double)a.data[e] * (double)one[a.indices[e]];
                        sum += product;
                        magnitude += fabs(product);
                    }
                    ck_assert_mem_eq(&alone, &sums[v], sizeof alone);
                    ck_assert_double_le(fabs((double)alone - sum), (N + 1) * FLT_EPSILON * magnitude);
                }
            }
        }
    free(X);
    csr_free(&a);
}
END_TEST

START_TEST(products_of_doubles_side_by_side) {
    enum { N = 83 };
    static const size_t widths[] = {1, 4, 8, 16};
    csr a = random_rows(N);
    double *X = aligned_alloc(64, N * CSR_DOUBLES_WIDTH * sizeof *X), one[N], sums[CSR_DOUBLES_WIDTH], alone;
    for (cpu_level set = CPU_PORTABLE; set <= cpu_best(); set++)
        for (size_t w = 0; w < 4; w++) {
            const size_t width = widths[w];
            ck_assert_uint_eq(csr_doubles_width(width), width);
            ck_assert_uint_eq(csr_doubles_width(width - width / 4), width);
            for (size_t j = 0; j < N * width; j++) X[j] = random_double();
            for (size_t i = 0; i < N; i++) {
                const uint64_t first = a.indptr[i], count = a.indptr[i + 1] - first;
                csr_doubles_row_of(set, width)(a.indices + first, a.data + first, count, X, sums);
                for (size_t v = 0; v < width; v++) {
                    long double sum = 0, magnitude = 0;
                    for (size_t j = 0; j < N; j++) one[j] = X[j * width + v];
                    csr_doubles_row_of(set, 1)(a.indices + first, a.data + first, count, one, &alone);
                    for (uint64_t e = first; e < first + count; e++) {
                        const long double product = (long double)a.data[e] * (long double)one[a.indices[e]];
                        sum += product;
                        magnitude += fabsl(product);
                    }
                    ck_assert_mem_eq(&alone, &sums[v], sizeof alone);
                    /* The promised bound, and the truth's own n 2^-64. */
                    const long double unit = 0x1p-53L * csr_doubles_roundings(count) + 83 * 0x1p-64L;
                    ck_assert(fabsl((long double)alone - sum) <= unit * magnitude);
                }
            }
        }
    free(X);
    csr_free(&a);
}
END_TEST

/* A batch of full, of nearly empty and of empty vectors: right, each with bits of its own, also where rows
 * are chosen. */
START_TEST(products_cost_what_they_touch) {
    enum { N = 83, M = 16, CHOSEN = 5 };
    static const uint32_t chosen[CHOSEN] = {82, 4, 0, 4, 61};
    uint32_t map[N];
    csr a = random_rows(N), columns;
    lam_error error = {.message = ""};
    ck_assert_int_eq(csr_transpose(&a, &columns, &error), LAM_OK);
    ck_assert_msg(csr_check(&columns, a.indptr[N], "columns", &error) == LAM_OK, "%s", error.message);
    float *X = calloc(N * M, sizeof *X), *Y = calloc(N * M, sizeof *Y), one[N], some[CHOSEN * M];
    void *work = aligned_alloc(64, (sparse_product_work(N, M) + 63) / 64 * 64);
    for (uint32_t i = 0; i < N; i++) map[i] = (i * 7 + 3) % N;
    for (size_t v = 0; v < M; v++)
        for (size_t j = 0; j < N; j++)
            if (v % 3 == 0 || (v % 3 == 1 && j % 40 == v % 5)) X[v * N + j] = (float)random_double();
    for (int adjoint = 0; adjoint < 2; adjoint++) {
        const sparse_pair A = {adjoint ? &columns : &a, adjoint ? &a : &columns, 2};
        sparse_product(&A, M, X, N, 0, NULL, NULL, Y, N, work);
        for (size_t v = 0; v < M; v++) {
            for (size_t i = 0; i < N; i++) {
                double sum = 0, magnitude = 0;
                for (uint64_t e = A.rows->indptr[i]; e < A.rows->indptr[i + 1]; e++) {
                    const double product = (double)A.rows->data[e] * (double)X[v * N + A.rows->indices[e]];
                    sum += product;
                    magnitude += fabs(product);
                }
                ck_assert_double_le(fabs((double)Y[v * N + i] - sum), (N + 1) * FLT_EPSILON * magnitude);
            }
            sparse_product(&A, 1, X + v * N, N, 0, NULL, NULL, one, N, work);
            ck_assert_mem_eq(one, Y + v * N, sizeof one);
        }
        for (int mapped = 0; mapped < 2; mapped++) {
            sparse_product(&A, M, X, N, CHOSEN, chosen, mapped ? map : NULL, some, CHOSEN, work);
            for (size_t v = 0; v < M; v++)
                for (size_t r = 0; r < CHOSEN; r++)
                    ck_assert_mem_eq(&some[v * CHOSEN + r], &Y[v * N + (mapped ? map[chosen[r]] : chosen[r])],
                                     sizeof *some);
        }
    }
    free(X);
    free(Y);
    free(work);
    csr_free(&a);
    csr_free(&columns);
}
END_TEST

START_TEST(product_agrees_with_the_dense_one) {
    enum { N = 83, FIRST = 3, LAST = 80 };
    csr a = random_rows(N);
    lam_error error = {.message = ""};
    ck_assert_msg(csr_check(&a, a.indptr[N], "F", &error) == LAM_OK, "%s", error.message);
    /* Up to two of the widest tiles and all of the narrower ones. */
    for (size_t m = 1; m <= 79; m++) {
        double *X = malloc(N * m * sizeof *X), *Y = malloc(N * m * sizeof *Y);
        for (size_t j = 0; j < N * m; j++) {
            X[j] = random_double();
            Y[j] = NAN;
        }
        csr_multiply_rows(&a, FIRST, LAST, m, X, Y);
        for (size_t i = 0; i < N; i++)
            for (size_t v = 0; v < m; v++) {
                double sum = 0, magnitude = 0;
                for (uint64_t e = a.indptr[i]; e < a.indptr[i + 1]; e++) {
                    double product = (double)a.data[e] * X[a.indices[e] * m + v];
                    sum += product;
                    magnitude += fabs(product);
                }
                if (i < FIRST || i >= LAST) /* other rows stay */
                    ck_assert(isnan(Y[i * m + v]));
                else /* at most N products, each rounded at most twice, in either order */
                    ck_assert_double_le(fabs(Y[i * m + v] - sum), (N + 1) * DBL_EPSILON * magnitude);
            }
        free(X);
        free(Y);
    }
    csr_free(&a);
    ck_assert_ptr_null(a.data);
    csr_free(&a);
    csr_free(NULL);
}
END_TEST

typedef struct defect {
    uint64_t indptr[4];
    uint32_t indices[4];
    float data[4];
    const char *word;
} defect;

static const defect defects[] = {
    {{1, 2, 2, 4}, {0, 1, 0, 2}, {1, 1, 1, 1}, "row 0"},
    {{0, 3, 2, 4}, {0, 1, 2, 2}, {1, 1, 1, 1}, "row 1 ends at 2"},
    {{0, 2, 9, 4}, {0, 1, 0, 2}, {1, 1, 1, 1}, "row 1 ends at 9"},
    {{0, UINT64_MAX, 2, 4}, {0, 1, 0, 2}, {1, 1, 1, 1}, "row 0 ends at"},
    {{0, 2, 2, 3}, {0, 1, 0, 2}, {1, 1, 1, 1}, "rows end at 3"},
    {{0, 2, 2, 4}, {0, 1, 0, 3}, {1, 1, 1, 1}, "column 3"},
    {{0, 2, 2, 4}, {1, 1, 0, 2}, {1, 1, 1, 1}, "column 1 after 1"},
    {{0, 2, 2, 4}, {1, 0, 0, 2}, {1, 1, 1, 1}, "column 0 after 1"},
    {{0, 2, 2, 4}, {0, 1, 0, 2}, {1, 1, NAN, 1}, "row 2"},
    {{0, 2, 2, 4}, {0, 1, 0, 2}, {1, -INFINITY, 1, 1}, "row 0"},
};

START_TEST(bad_rows_are_refused) {
    lam_error error = {.message = ""};
    defect good = {{0, 2, 2, 4}, {0, 1, 0, 2}, {1, 1, 1, 1}, NULL};
    csr a = {.n = 3, .indptr = good.indptr, .indices = good.indices, .data = good.data};
    ck_assert(csr_check(&a, 4, "F", &error) == LAM_OK);
    for (size_t i = 0; i < sizeof defects / sizeof *defects; i++) {
        defect bad = defects[i];
        a = (csr){.n = 3, .indptr = bad.indptr, .indices = bad.indices, .data = bad.data};
        ck_assert_msg(csr_check(&a, 4, "F", &error) == LAM_ERR_FORMAT, "defect %zu passes", i);
        ck_assert_msg(strstr(error.message, bad.word) != NULL && strncmp(error.message, "F:", 2) == 0,
                      "defect %zu: %s", i, error.message);
    }
    uint64_t none = 0;
    a = (csr){.n = 0, .indptr = &none};
    ck_assert(csr_check(&a, 0, "F", &error) == LAM_OK);
    ck_assert(csr_check(&a, 1, "F", &error) == LAM_ERR_FORMAT);
}
END_TEST

/* Few entries, symmetric in pattern, some of them 0, against labels that neighbours lower until none changes.
 */
START_TEST(parts_are_what_entries_join) {
    enum { N = 60 };
    uint64_t indptr[N + 1], seed = 3 + (uint64_t)_i;
    uint32_t indices[N * N], part[N], label[N];
    float data[N * N], dense[N][N] = {{0}};
    size_t count = 0, expected = 0;
    for (size_t e = 0; e < 4 * (size_t)_i; e++) {
        const size_t i = (size_t)(random_lcg_unit(&seed) * N), j = (size_t)(random_lcg_unit(&seed) * N);
        dense[i][j] = dense[j][i] = e % 4 == 1 ? -1 : 1; /* -1: stored as 0 */
    }
    indptr[0] = 0;
    for (size_t i = 0; i < N; i++) {
        indptr[i + 1] = indptr[i];
        for (size_t j = 0; j < N; j++)
            if (dense[i][j] != 0) {
                indices[indptr[i + 1]] = (uint32_t)j;
                data[indptr[i + 1]++] = dense[i][j] > 0 ? 1e-20f : 0;
            }
    }
    for (size_t i = 0; i < N; i++) label[i] = (uint32_t)i;
    for (size_t round = 0; round < N; round++)
        for (size_t i = 0; i < N; i++)
            for (size_t j = 0; j < N; j++)
                if (dense[i][j] > 0 && label[j] < label[i]) label[i] = label[j];
    csr_parts(&(csr){.n = N, .indptr = indptr, .indices = indices, .data = data}, part, &count);
    for (size_t i = 0; i < N; i++) {
        ck_assert_uint_lt(part[i], count);
        for (size_t j = 0; j < i; j++) ck_assert((label[i] == label[j]) == (part[i] == part[j]));
        if (label[i] == i) ck_assert_uint_eq(part[i], expected++);
    }
    ck_assert_uint_eq(count, expected);
}
END_TEST

/* Every row of the symmetric matrix, with ascending columns, for any number of threads. */
START_TEST(an_upper_triangle_is_mirrored) {
    enum { N = 203 };
    static const size_t sizes[] = {1, 2, 7, N};
    lam_error error = {.message = ""};
    const int most = omp_get_max_threads();
    for (size_t s = 0; s < 4; s++) {
        const size_t n = sizes[s];
        csr a = random_rows(n), upper = {.n = n,
                                         .indptr = calloc(n + 1, sizeof *upper.indptr),
                                         .indices = malloc((n * n + 1) * sizeof *upper.indices),
                                         .data = malloc((n * n + 1) * sizeof *upper.data)};
        float *dense = calloc(n * n, sizeof *dense);
        uint64_t used = 0;
        for (size_t i = 0; i < n; upper.indptr[++i] = used)
            for (uint64_t e = a.indptr[i]; e < a.indptr[i + 1]; e++) {
                const uint32_t j = a.indices[e];
                if (j < i) continue;
                upper.indices[used] = j;
                upper.data[used++] = e % 7 == 0 ? 0 : a.data[e]; /* zeros are left out */
                dense[i * n + j] = dense[j * n + i] = upper.data[used - 1];
            }
        for (int threads = 1; threads <= 4; threads++) {
            csr found;
            size_t at = 0;
            omp_set_num_threads(threads);
            ck_ok(csr_mirror(&upper, "matrix", &found, &error));
            for (size_t i = 0; i < n; i++) {
                ck_assert_uint_eq(found.indptr[i], at);
                for (size_t j = 0; j < n; j++) {
                    if (dense[i * n + j] == 0) continue;
                    ck_assert_uint_lt(at, found.indptr[i + 1]);
                    ck_assert_uint_eq(found.indices[at], j);
                    ck_assert(found.data[at++] == dense[i * n + j]);
                }
                ck_assert_uint_eq(found.indptr[i + 1], at);
            }
            for (size_t parts = 1; parts <= n + 3; parts++) {
                ck_assert_uint_eq(csr_part(&found, 0, parts), 0);
                ck_assert_uint_eq(csr_part(&found, parts, parts), n);
                for (size_t k = 0; k < parts; k++)
                    ck_assert_uint_le(csr_part(&found, k, parts), csr_part(&found, k + 1, parts));
            }
            csr_free(&found);
        }
        csr_free(&a);
        csr_free(&upper);
        free(dense);
    }
    omp_set_num_threads(most);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("csr");
    TCase *tests = tcase_create("csr");
    tcase_set_timeout(tests, 120);
    tcase_add_test(tests, product_agrees_with_the_dense_one);
    tcase_add_test(tests, products_of_floats_side_by_side);
    tcase_add_test(tests, products_of_doubles_side_by_side);
    tcase_add_test(tests, products_cost_what_they_touch);
    tcase_add_test(tests, bad_rows_are_refused);
    tcase_add_test(tests, an_upper_triangle_is_mirrored);
    tcase_add_loop_test(tests, parts_are_what_entries_join, 0, 40);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
