/* The two products of a dense matrix, on every instruction set this CPU has. */
#include "solver/base/half.h"
#include "solver/base/random.h"
#include "solver/base/work_area.h"
#include "solver/linalg/panel.h"
#include "support/suite.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

static uint64_t random_state;

/* A number in (-1, 1), never 0. */
static float random_float(void) {
    return (float)((double)(random_lcg(&random_state) >> 40) + 0.5) / 8388608.0f - 1.0f;
}

static float *random_floats(size_t count) {
    float *x = malloc((count + 1) * sizeof *x);
    for (size_t i = 0; i < count; i++) x[i] = random_float();
    return x;
}

typedef struct shape {
    size_t n, k;
} shape;

/* Around every tile, chunk and block: 4 rows, 128 rows, 1024 rows, 16 columns, 2048 columns. */
static const shape shapes[] = {{1, 1},   {1, 0},    {2, 15},  {3, 16},   {4, 17},   {7, 33},   {8, 64},
                               {9, 100}, {128, 40}, {129, 5}, {300, 48}, {5, 2049}, {6, 4200}, {1025, 20}};
enum { SHAPES = sizeof shapes / sizeof *shapes, GAP = 3, VECTORS = 2 * PANEL_VECTORS + 3 };

typedef struct subject {
    panel a;
    double *kept; /* [n][k]: what the panel holds, exactly */
    float *rows, *X, *T;
    void *work, *memory;
} subject;

static double kept_value(const panel *a, const void *values, size_t at) {
    const double scale = a->scale != NULL ? (double)a->scale[at % a->k] : 1.0;
    switch (a->precision) {
    case PANEL_F32:
        return (double)((const float *)values)[at];
    case PANEL_F16:
        return scale * (double)float_of_half(((const uint16_t *)values)[at]);
    case PANEL_I8:
        return scale * (double)((const int8_t *)values)[at];
    }
    return NAN;
}

static double *kept_values(const panel *a) {
    double *kept = malloc((a->n * a->k + 1) * sizeof *kept);
    void *values = malloc(a->n * a->k * sizeof(float) + 1);
    panel_copy_values(a, values);
    for (size_t at = 0; at < a->n * a->k; at++) kept[at] = kept_value(a, values, at);
    free(values);
    return kept;
}

/* rows and a, which has n x k numbers of a precision. Odd columns are too large for f16 as they are. */
static void make_panel(size_t n, size_t k, panel_precision precision, float **rows, panel *a) {
    lam_error error = {.message = ""};
    panel wide;
    *rows = random_floats(n * k);
    for (size_t at = 0; at < n * k; at++)
        if (at % k % 2 == 1) (*rows)[at] *= 1e6f;
    ck_assert_msg(panel_create(n, k, *rows, "A", &wide, &error) == LAM_OK, "%s", error.message);
    ck_assert_msg(panel_convert(&wide, precision, "A", a, &error) == LAM_OK, "%s", error.message);
    panel_free(&wide);
}

static void subject_make(subject *s, shape size, panel_precision precision, const panel_kernels *kernels) {
    random_state = 17;
    s->X = random_floats(VECTORS * (size.n + GAP));
    s->T = random_floats(VECTORS * (size.k + GAP));
    make_panel(size.n, size.k, precision, &s->rows, &s->a);
    s->kept = kept_values(&s->a);
    s->a.kernels = kernels;
    s->memory = malloc(panel_work_bytes(&s->a, VECTORS) + WORK_AREA_ALIGN);
    s->work =
        (char *)s->memory + (WORK_AREA_ALIGN - (uintptr_t)s->memory % WORK_AREA_ALIGN) % WORK_AREA_ALIGN;
}

static void subject_free(subject *s) {
    panel_free(&s->a);
    free(s->rows);
    free(s->kept);
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
 * (128 + 1) u of the sum of magnitudes; the tree over 16 lanes and the last rounding add 5 u, the product
 * with a scale 1 u. */
#define TOLERANCE(terms) (((terms) < 128 ? (double)(terms) : 128.0) + 7.0) * (FLT_EPSILON / 2.0)

START_TEST(products_agree_with_sums_in_double) {
    for (cpu_level set = CPU_PORTABLE; set <= cpu_best(); set++)
        for (size_t shape_index = 0; shape_index < SHAPES; shape_index++) {
            size_t n = shapes[shape_index].n, k = shapes[shape_index].k;
            subject s;
            subject_make(&s, shapes[shape_index], (panel_precision)_i, panel_kernels_of(set));
            float *T = nan_floats(VECTORS * (k + GAP)), *Y = nan_floats(VECTORS * (n + GAP));
            panel_project(&s.a, VECTORS, s.X, n + GAP, T, k + GAP, s.work);
            panel_expand(&s.a, VECTORS, s.T, k + GAP, Y, n + GAP, s.work);
            for (size_t v = 0; v < VECTORS; v++) {
                for (size_t j = 0; j < k + GAP; j++) {
                    double sum = 0, magnitude = 0;
                    for (size_t i = 0; i < n && j < k; i++) {
                        double product = s.kept[i * k + j] * (double)s.X[v * (n + GAP) + i];
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
                        double product = s.kept[i * k + j] * (double)s.T[v * (k + GAP) + j];
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
    /* Around the vectors that kernels take at once: 1, 2, 4 and 16. */
    static const size_t batches[] = {1, 2, 3, 4, 5, 8, 15, 16, 17, VECTORS};
    for (cpu_level set = CPU_PORTABLE; set <= cpu_best(); set++)
        for (size_t shape_index = 0; shape_index < SHAPES; shape_index++) {
            size_t n = shapes[shape_index].n, k = shapes[shape_index].k;
            subject s;
            subject_make(&s, shapes[shape_index], (panel_precision)_i, panel_kernels_of(set));
            /* Vector 1 is almost empty: alone it skips rows that its neighbours need. */
            for (size_t i = 0; i < n; i++)
                if (i != n / 2) s.X[n + GAP + i] = 0.0f;
            float *T = nan_floats(VECTORS * k), *Y = nan_floats(VECTORS * n);
            float *t = nan_floats(k), *y = nan_floats(n);
            for (size_t b = 0; b < sizeof batches / sizeof *batches; b++) {
                const size_t m = batches[b];
                panel_project(&s.a, m, s.X, n + GAP, T, k, s.work);
                panel_expand(&s.a, m, s.T, k + GAP, Y, n, s.work);
                for (size_t v = 0; v < m; v += m > 4 ? 5 : 1) {
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
    if (cpu_best() < CPU_AVX512) return;
    const panel_kernels *first = panel_kernels_of(CPU_AVX512), *second = panel_kernels_of(CPU_AVX2);
    size_t n = 300, k = 100;
    subject s;
    subject_make(&s, (shape){n, k}, (panel_precision)_i, first);
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
    void *work = aligned_alloc(WORK_AREA_ALIGN, panel_work_bytes(&wide, 1));
    for (cpu_level set = CPU_PORTABLE; set <= cpu_best(); set++) {
        tall.kernels = wide.kernels = panel_kernels_of(set);
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
    size_t n = 1501, k = 1003; /* 6 MB: huge pages */
    subject s;
    subject_make(&s, (shape){n, k}, PANEL_F32, panel_kernels_of(cpu_best()));
    float *copy = nan_floats(n * k);
    panel_copy_rows(&s.a, copy);
    ck_assert_mem_eq(copy, s.rows, n * k * sizeof *copy);
    ck_assert_uint_eq(panel_bytes(&s.a), n * 1008 * sizeof *copy);
    ck_assert_uint_eq((uintptr_t)s.a.data % WORK_AREA_ALIGN, 0);
    free(copy);
    subject_free(&s);
}
END_TEST

/* Any rows in any order, through a map or not: those of the whole product. */
START_TEST(chosen_rows_have_the_same_bits) {
    for (cpu_level set = CPU_PORTABLE; set <= cpu_best(); set++) {
        enum { N = 301, K = 2085, CHOSEN = 70 };
        subject s;
        uint32_t rows[CHOSEN], map[N];
        subject_make(&s, (shape){N, K}, (panel_precision)_i, panel_kernels_of(set));
        for (size_t r = 0; r < CHOSEN; r++) rows[r] = (uint32_t)(r * r * 3 % N);
        for (size_t i = 0; i < N; i++) map[i] = (uint32_t)(N - 1 - i);
        float *Y = nan_floats(VECTORS * N), *some = nan_floats(VECTORS * CHOSEN);
        panel_expand(&s.a, VECTORS, s.T, K + GAP, Y, N, s.work);
        for (int mapped = 0; mapped < 2; mapped++) {
            panel_expand_rows(&s.a, VECTORS, s.T, K + GAP, CHOSEN, rows, mapped ? map : NULL, some, CHOSEN,
                              s.work);
            for (size_t v = 0; v < VECTORS; v++)
                for (size_t r = 0; r < CHOSEN; r++)
                    ck_assert_mem_eq(&some[v * CHOSEN + r], &Y[v * N + (mapped ? map[rows[r]] : rows[r])],
                                     sizeof(float));
        }
        free(Y);
        free(some);
        subject_free(&s);
    }
}
END_TEST

/* The values of a as they are kept, [n][k] values in a place that begins odd where it may, with what is no
 * number behind. */
static panel view_of(const panel *a, void **memory) {
    const size_t size = panel_value_size(a->precision), bytes = a->n * a->k * size;
    lam_error error = {.message = ""};
    panel rows = {0};
    char *values = (char *)malloc(bytes + size + PANEL_SLACK);
    *memory = values;
    values += size;
    panel_copy_values(a, values);
    memset(values + bytes, 0xff, PANEL_SLACK);
    ck_assert_msg(panel_view(a->n, a->k, a->precision, values, a->scale, "A", &rows, &error) == LAM_OK, "%s",
                  error.message);
    rows.kernels = a->kernels;
    rows.n_threads = a->n_threads;
    return rows;
}

/* Rows as they lie in a store take part in the same sums as tiles, whatever stands behind them. */
START_TEST(rows_give_the_bits_of_tiles) {
    static const size_t batches[] = {1, 2, 4, 5, 16, VECTORS};
    for (cpu_level set = CPU_PORTABLE; set <= cpu_best(); set++)
        for (size_t shape_index = 0; shape_index < SHAPES; shape_index++) {
            const size_t n = shapes[shape_index].n, k = shapes[shape_index].k;
            subject s;
            void *memory;
            subject_make(&s, shapes[shape_index], (panel_precision)_i, panel_kernels_of(set));
            panel rows = view_of(&s.a, &memory);
            ck_assert_uint_eq(panel_work_bytes(&rows, VECTORS), panel_work_bytes(&s.a, VECTORS));
            /* Vector 0 has dark elements, so that tiles are read in part. */
            for (size_t i = 0; i < n; i++)
                if (i % 3 == 1) s.X[i] = 0.0f;
            float *T[2], *Y[2], *some[2];
            uint32_t chosen[5];
            for (size_t r = 0; r < 5; r++) chosen[r] = (uint32_t)((n - 1) * r / 4);
            for (int i = 0; i < 2; i++) {
                T[i] = nan_floats(VECTORS * (k + GAP));
                Y[i] = nan_floats(VECTORS * (n + GAP));
                some[i] = nan_floats(VECTORS * 5);
            }
            for (size_t b = 0; b < sizeof batches / sizeof *batches; b++) {
                for (int i = 0; i < 2; i++) {
                    const panel *a = i == 0 ? &s.a : &rows;
                    panel_project(a, batches[b], s.X, n + GAP, T[i], k + GAP, s.work);
                    panel_expand(a, batches[b], s.T, k + GAP, Y[i], n + GAP, s.work);
                    panel_expand_rows(a, batches[b], s.T, k + GAP, 5, chosen, NULL, some[i], 5, s.work);
                }
                ck_assert_mem_eq(T[0], T[1], VECTORS * (k + GAP) * sizeof **T);
                ck_assert_mem_eq(Y[0], Y[1], VECTORS * (n + GAP) * sizeof **Y);
                ck_assert_mem_eq(some[0], some[1], VECTORS * 5 * sizeof **some);
                ck_assert(!isnan(Y[1][batches[b] * (n + GAP) - GAP - 1]));
            }
            for (int i = 0; i < 2; i++) {
                free(T[i]);
                free(Y[i]);
                free(some[i]);
            }
            panel_free(&rows);
            free(memory);
            subject_free(&s);
        }
}
END_TEST

/* A view gives back what it sees, and can be made into another precision. */
START_TEST(views_can_be_copied) {
    enum { N = 37, K = 53 };
    lam_error error = {.message = ""};
    subject s;
    void *memory;
    panel narrow[2];
    float copies[2][N * K];
    subject_make(&s, (shape){N, K}, (panel_precision)_i, panel_kernels_of(cpu_best()));
    panel rows = view_of(&s.a, &memory);
    panel_copy_rows(&s.a, copies[0]);
    panel_copy_rows(&rows, copies[1]);
    ck_assert_mem_eq(copies[0], copies[1], sizeof copies[0]);
    memset(copies, 0, sizeof copies);
    panel_copy_values(&s.a, copies[0]);
    panel_copy_values(&rows, copies[1]);
    ck_assert_mem_eq(copies[0], copies[1], sizeof copies[0]);
    ck_assert_uint_eq(panel_bytes(&rows), N * K * panel_value_size(rows.precision) +
                                              (rows.scale != NULL ? K * sizeof(float) : 0));
    for (int i = 0; i < 2 && _i == PANEL_F32; i++) {
        ck_assert(panel_convert(i == 0 ? &s.a : &rows, PANEL_F16, "A", &narrow[i], &error) == LAM_OK);
        panel_copy_rows(&narrow[i], copies[i]);
        panel_free(&narrow[i]);
    }
    ck_assert_mem_eq(copies[0], copies[1], sizeof copies[0]);
    const float bad[K] = {1, 0};
    panel untouched = {.n = 3};
    ck_assert(panel_view(N, K, rows.precision, rows.rows, bad, "A", &untouched, &error) == LAM_ERR_NUMERIC);
    ck_assert_ptr_nonnull(strstr(error.message, "A_scale[1] = 0"));
    ck_assert_uint_eq(untouched.n, 3);
    panel_free(&rows);
    free(memory);
    subject_free(&s);
}
END_TEST

/* Large enough that threads are used; 3 do not divide the blocks evenly. */
START_TEST(bits_do_not_depend_on_threads) {
    enum { N = 9001, K = 130, M = 5 };
    static const size_t threads[] = {1, 2, 3, 8};
    subject s;
    float *T[4], *Y[4];
    subject_make(&s, (shape){N, K}, (panel_precision)_i, panel_kernels_of(cpu_best()));
    for (size_t i = 0; i < N; i++) s.X[N + GAP + i] = i < 3000 || i > 6100 ? 0.0f : s.X[i]; /* empty slabs */
    for (size_t i = 0; i < 4; i++) {
        s.a.n_threads = threads[i];
        void *work = aligned_alloc(WORK_AREA_ALIGN, panel_work_bytes(&s.a, M));
        T[i] = nan_floats(M * K);
        Y[i] = nan_floats(M * N);
        panel_project(&s.a, M, s.X, N + GAP, T[i], K, work);
        panel_expand(&s.a, M, s.T, K + GAP, Y[i], N, work);
        ck_assert_mem_eq(T[i], T[0], M * K * sizeof **T);
        ck_assert_mem_eq(Y[i], Y[0], M * N * sizeof **Y);
        ck_assert(!isnan(T[i][0]) && !isnan(Y[i][0]));
        free(work);
    }
    for (size_t i = 0; i < 4; i++) {
        free(T[i]);
        free(Y[i]);
    }
    subject_free(&s);
}
END_TEST

/* Numbers below the least normal one are numbers: each product and sum is off by at most 2^-150 more. */
START_TEST(subnormal_numbers_count) {
    enum { N = 40, K = 35 };
    for (cpu_level set = CPU_PORTABLE; set <= cpu_best(); set++) {
        lam_error error = {.message = ""};
        uint16_t halves[N * K];
        float tiny[N * K], ones[K], Y[N];
        panel a;
        random_state = 5;
        for (size_t at = 0; at < N * K; at++) {
            halves[at] = (uint16_t)(1 + at % 1000); /* multiples of 2^-24 below 2^-14 */
            tiny[at] = ldexpf(random_float(), -130);
        }
        for (size_t j = 0; j < K; j++) ones[j] = 1.0f;
        for (int half = 0; half < 2; half++) {
            ck_assert(panel_create_kept(N, K, half ? PANEL_F16 : PANEL_F32, half ? (void *)halves : tiny,
                                        NULL, "A", &a, &error) == LAM_OK);
            a.kernels = panel_kernels_of(set);
            void *work = aligned_alloc(WORK_AREA_ALIGN, panel_work_bytes(&a, 1));
            panel_expand(&a, 1, ones, K, Y, N, work);
            for (size_t i = 0; i < N; i++) {
                double sum = 0, magnitude = 0;
                for (size_t j = 0; j < K; j++) {
                    const double x = half ? ldexp(halves[i * K + j], -24) : (double)tiny[i * K + j];
                    sum += x;
                    magnitude += fabs(x);
                }
                ck_assert(sum != 0);
                ck_assert_double_le(fabs((double)Y[i] - sum), TOLERANCE(K) * magnitude + 2 * K * 0x1p-150);
            }
            free(work);
            panel_free(&a);
        }
    }
}
END_TEST

/* Half a unit in the last place of f16, of a column's step in i8. */
START_TEST(conversion_rounds_to_nearest) {
    const panel_precision precision = (panel_precision)_i;
    enum { N = 61, K = 37 };
    static const double relative[] = {0, 0x1p-11, 0};
    float *rows;
    panel a;
    random_state = 23;
    make_panel(N, K, precision, &rows, &a);
    double *kept = kept_values(&a);
    ck_assert((a.scale != NULL) == (precision == PANEL_F16 || precision == PANEL_I8));
    for (size_t at = 0; at < N * K; at++) {
        const double x = (double)rows[at], scale = a.scale != NULL ? (double)a.scale[at % K] : 1.0;
        double bound = relative[precision] * fabs(x);
        if (precision == PANEL_F16) bound = fmax(bound, 0x1p-25 * scale);
        /* the scale itself and the quotient are rounded, of at most 127 steps */
        if (precision == PANEL_I8) bound = scale * (0.5 + 127 * 0x1p-22);
        ck_assert_double_le(fabs(kept[at] - x), bound);
    }
    free(kept);
    free(rows);
    panel_free(&a);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("panel");
    TCase *tests = tcase_create("panel");
    tcase_set_timeout(tests, 300);
    tcase_add_loop_test(tests, products_agree_with_sums_in_double, 0, PANEL_PRECISIONS);
    tcase_add_loop_test(tests, bits_do_not_depend_on_the_batch, 0, PANEL_PRECISIONS);
    tcase_add_loop_test(tests, wide_instruction_sets_give_the_same_bits, 0, PANEL_PRECISIONS);
    tcase_add_loop_test(tests, chosen_rows_have_the_same_bits, 0, PANEL_PRECISIONS);
    tcase_add_loop_test(tests, rows_give_the_bits_of_tiles, 0, PANEL_PRECISIONS);
    tcase_add_loop_test(tests, views_can_be_copied, 0, PANEL_PRECISIONS);
    tcase_add_loop_test(tests, bits_do_not_depend_on_threads, 0, PANEL_PRECISIONS);
    tcase_add_test(tests, subnormal_numbers_count);
    tcase_add_loop_test(tests, conversion_rounds_to_nearest, 0, PANEL_PRECISIONS);
    tcase_add_test(tests, long_sums_end_in_double);
    tcase_add_test(tests, large_matrices_come_back_as_they_went_in);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
