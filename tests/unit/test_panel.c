/* The two products of a dense matrix, on every instruction set this CPU has. */
#include "solver/operator/panel.h"
#include "support/suite.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

static uint64_t random_state;

/* In (-1, 1), never 0. */
static float random_float(void) {
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (float)((double)(random_state >> 40) + 0.5) / 8388608.0f - 1.0f;
}

static float *random_floats(size_t count) {
    float *x = malloc((count + 1) * sizeof *x);
    for (size_t i = 0; i < count; i++) x[i] = random_float();
    return x;
}

typedef struct shape {
    size_t n, k;
} shape;

/* Around every tile, chunk and block: 4 rows, 8 rows, 128 rows, 16 columns, 2048 columns. */
static const shape shapes[] = {{1, 1},   {1, 0},    {2, 15},  {3, 16},   {4, 17},   {7, 33},  {8, 64},
                               {9, 100}, {128, 40}, {129, 5}, {300, 48}, {5, 2049}, {6, 4200}};
enum { SHAPES = sizeof shapes / sizeof *shapes, GAP = 3, VECTORS = 2 * PANEL_VECTORS + 3 };

typedef struct subject {
    panel a;
    float *rows, *X, *T;
    void *work, *memory;
} subject;

static void subject_make(subject *s, shape size, const panel_kernels *kernels) {
    lam_error error = {.message = ""};
    random_state = 17;
    s->rows = random_floats(size.n * size.k);
    s->X = random_floats(VECTORS * (size.n + GAP));
    s->T = random_floats(VECTORS * (size.k + GAP));
    ck_assert_msg(panel_create(size.n, size.k, s->rows, "A", &s->a, &error) == LAM_OK, "%s", error.message);
    s->a.kernels = kernels;
    s->memory = malloc(panel_work_bytes(&s->a, VECTORS) + PANEL_ALIGN);
    s->work = (char *)s->memory + (PANEL_ALIGN - (uintptr_t)s->memory % PANEL_ALIGN) % PANEL_ALIGN;
}

static void subject_free(subject *s) {
    panel_free(&s->a);
    free(s->rows);
    free(s->X);
    free(s->T);
    free(s->memory);
}

static float *nan_floats(size_t count) {
    float *x = malloc((count + 1) * sizeof *x);
    for (size_t i = 0; i < count; i++) x[i] = NAN;
    return x;
}

/* Each of the at most 128 products that a float sum adds is rounded at most twice, in all at most
 * (128 + 1) u of the sum of magnitudes; the tree over 16 lanes and the last rounding add 5 u. */
#define TOLERANCE(terms) (((terms) < 128 ? (double)(terms) : 128.0) + 6.0) * (FLT_EPSILON / 2.0)

START_TEST(products_agree_with_sums_in_double) {
    for (size_t set = 0; panel_kernels_available(set) != NULL; set++)
        for (size_t shape_index = 0; shape_index < SHAPES; shape_index++) {
            size_t n = shapes[shape_index].n, k = shapes[shape_index].k;
            subject s;
            subject_make(&s, shapes[shape_index], panel_kernels_available(set));
            float *T = nan_floats(VECTORS * (k + GAP)), *Y = nan_floats(VECTORS * (n + GAP));
            panel_project(&s.a, VECTORS, s.X, n + GAP, T, k + GAP, s.work);
            panel_expand(&s.a, VECTORS, s.T, k + GAP, Y, n + GAP, s.work);
            for (size_t v = 0; v < VECTORS; v++) {
                for (size_t j = 0; j < k + GAP; j++) {
                    double sum = 0, magnitude = 0;
                    for (size_t i = 0; i < n && j < k; i++) {
                        double product = (double)s.rows[i * k + j] * (double)s.X[v * (n + GAP) + i];
                        sum += product;
                        magnitude += fabs(product);
                    }
                    float found = T[v * (k + GAP) + j];
                    if (j >= k) /* between the vectors nothing is written */
                        ck_assert(isnan(found));
                    else
                        ck_assert_double_le(fabs((double)found - sum), TOLERANCE(n) * magnitude);
                }
                for (size_t i = 0; i < n + GAP; i++) {
                    double sum = 0, magnitude = 0;
                    for (size_t j = 0; j < k && i < n; j++) {
                        double product = (double)s.rows[i * k + j] * (double)s.T[v * (k + GAP) + j];
                        sum += product;
                        magnitude += fabs(product);
                    }
                    float found = Y[v * (n + GAP) + i];
                    if (i >= n)
                        ck_assert(isnan(found));
                    else
                        ck_assert_double_le(fabs((double)found - sum), TOLERANCE(k) * magnitude);
                }
            }
            free(T);
            free(Y);
            subject_free(&s);
        }
}
END_TEST

START_TEST(bits_do_not_depend_on_the_batch) {
    for (size_t set = 0; panel_kernels_available(set) != NULL; set++)
        for (size_t shape_index = 0; shape_index < SHAPES; shape_index++) {
            size_t n = shapes[shape_index].n, k = shapes[shape_index].k;
            subject s;
            subject_make(&s, shapes[shape_index], panel_kernels_available(set));
            /* Vector 1 is almost empty: alone it skips rows that its neighbours need. */
            for (size_t i = 0; i < n; i++)
                if (i != n / 2) s.X[n + GAP + i] = 0.0f;
            float *T = nan_floats(VECTORS * k), *Y = nan_floats(VECTORS * n);
            float *t = nan_floats(k), *y = nan_floats(n);
            for (size_t m = 1; m <= VECTORS; m++) {
                panel_project(&s.a, m, s.X, n + GAP, T, k, s.work);
                panel_expand(&s.a, m, s.T, k + GAP, Y, n, s.work);
                for (size_t v = 0; v<m; v += m> 4 ? 5 : 1) {
                    panel_project(&s.a, 1, s.X + v * (n + GAP), n + GAP, t, k, s.work);
                    panel_expand(&s.a, 1, s.T + v * (k + GAP), k + GAP, y, n, s.work);
                    ck_assert_mem_eq(t, T + v * k, k * sizeof *t);
                    ck_assert_mem_eq(y, Y + v * n, n * sizeof *y);
                }
            }
            free(T);
            free(Y);
            free(t);
            free(y);
            subject_free(&s);
        }
}
END_TEST

/* Both fuse a b + c and add the same 16 lanes in the same order. */
START_TEST(wide_instruction_sets_give_the_same_bits) {
    const panel_kernels *first = panel_kernels_available(0), *second = panel_kernels_available(1);
    if (second == NULL || panel_kernels_available(2) == NULL) return; /* this CPU has not both */
    size_t n = 300, k = 100;
    subject s;
    subject_make(&s, (shape){n, k}, first);
    float *T[2], *Y[2];
    for (int i = 0; i < 2; i++) {
        T[i] = nan_floats(VECTORS * k);
        Y[i] = nan_floats(VECTORS * n);
        s.a.kernels = i == 0 ? first : second;
        panel_project(&s.a, VECTORS, s.X, n + GAP, T[i], k, s.work);
        panel_expand(&s.a, VECTORS, s.T, k + GAP, Y[i], n, s.work);
    }
    ck_assert_mem_eq(T[0], T[1], VECTORS * k * sizeof **T);
    ck_assert_mem_eq(Y[0], Y[1], VECTORS * n * sizeof **Y);
    for (int i = 0; i < 2; i++) {
        free(T[i]);
        free(Y[i]);
    }
    subject_free(&s);
}
END_TEST

/* 100,000 ones in single precision alone would be off by far more than one rounding of the sum. */
START_TEST(long_sums_end_in_double) {
    enum { N = 100000 };
    float *ones = malloc(N * sizeof *ones), sum = 0;
    lam_error error = {.message = ""};
    panel tall = {0}, wide = {0};
    for (size_t i = 0; i < N; i++) ones[i] = 0.1f;
    double exact = (double)N * 0.1f * 0.1f;
    ck_assert(panel_create(N, 1, ones, "A", &tall, &error) == LAM_OK);
    ck_assert(panel_create(1, N, ones, "A", &wide, &error) == LAM_OK);
    void *work = aligned_alloc(PANEL_ALIGN, panel_work_bytes(&wide, 1));
    for (size_t set = 0; panel_kernels_available(set) != NULL; set++) {
        tall.kernels = wide.kernels = panel_kernels_available(set);
        panel_project(&tall, 1, ones, N, &sum, 1, work);
        ck_assert_double_le(fabs((double)sum - exact), TOLERANCE(128) * exact);
        panel_expand(&wide, 1, ones, N, &sum, 1, work);
        ck_assert_double_le(fabs((double)sum - exact), TOLERANCE(128) * exact);
    }
    free(work);
    free(ones);
    panel_free(&tall);
    panel_free(&wide);
}
END_TEST

START_TEST(large_matrices_come_back_as_they_went_in) {
    size_t n = 1500, k = 1003; /* 6 MB: huge pages */
    subject s;
    subject_make(&s, (shape){n, k}, panel_kernels_available(0));
    float *copy = nan_floats(n * k);
    panel_copy_rows(&s.a, copy);
    ck_assert_mem_eq(copy, s.rows, n * k * sizeof *copy);
    ck_assert_uint_eq(panel_bytes(&s.a), n * 1008 * sizeof *copy);
    ck_assert_uint_eq((uintptr_t)s.a.data % PANEL_ALIGN, 0);
    free(copy);
    subject_free(&s);
}
END_TEST

START_TEST(bad_matrices_are_refused) {
    lam_error error = {.message = ""};
    panel a = {.n = 4};
    float rows[40];
    const float bad[] = {NAN, INFINITY, -INFINITY};
    for (size_t i = 0; i < 3; i++) {
        for (size_t j = 0; j < 40; j++) rows[j] = FLT_MAX; /* finite, though its sums are not */
        rows[1 * 20 + 13] = bad[i];
        ck_assert(panel_create(2, 20, rows, "Y", &a, &error) == LAM_ERR_NUMERIC);
        ck_assert_ptr_nonnull(strstr(error.message, "Y[1][13]"));
    }
    ck_assert(panel_create(SIZE_MAX / 8, 20, rows, "Y", &a, &error) == LAM_ERR_MEMORY);
    ck_assert(panel_create(1, SIZE_MAX - 3, rows, "Y", &a, &error) == LAM_ERR_MEMORY);
    ck_assert(panel_create(SIZE_MAX / 100, 16, rows, "Y", &a, &error) == LAM_ERR_MEMORY);
    ck_assert_uint_eq(a.n, 4); /* untouched */
}
END_TEST

int main(void) {
    Suite *suite = suite_create("panel");
    TCase *tests = tcase_create("panel");
    tcase_set_timeout(tests, 300);
    tcase_add_test(tests, products_agree_with_sums_in_double);
    tcase_add_test(tests, bits_do_not_depend_on_the_batch);
    tcase_add_test(tests, wide_instruction_sets_give_the_same_bits);
    tcase_add_test(tests, long_sums_end_in_double);
    tcase_add_test(tests, large_matrices_come_back_as_they_went_in);
    tcase_add_test(tests, bad_matrices_are_refused);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
