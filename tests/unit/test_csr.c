/* Sparse rows: their product and what the check refuses. */
#include "solver/operator/csr.h"
#include "support/suite.h"

#include <float.h>
#include <math.h>
#include <string.h>

static uint64_t random_state = 9;

static double random_double(void) {
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (double)(random_state >> 11) / 9007199254740992.0 - 0.5;
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

int main(void) {
    Suite *suite = suite_create("csr");
    TCase *tests = tcase_create("csr");
    tcase_set_timeout(tests, 120);
    tcase_add_test(tests, product_agrees_with_the_dense_one);
    tcase_add_test(tests, bad_rows_are_refused);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
