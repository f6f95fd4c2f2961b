/* Runs of consecutive numbers: their sums against double, the same bits on every instruction set. */
#include "solver/base/random.h"
#include "solver/linalg/segments.h"
#include "support/suite.h"

#include <math.h>
#include <string.h>

static lam_error error;
static uint64_t random_state = 3;

static double random_double(void) {
    return random_lcg_unit(&random_state) - 0.5;
}

/* Runs of every length from 0 to 40, and one of 5000. */
enum { RUNS = 42, N = 40 * 41 / 2 + 5000 };

static segments runs(bool weighted) {
    segments s;
    uint64_t *I = calloc(RUNS + 1, sizeof *I);
    float *weight = weighted ? malloc(N * sizeof *weight) : NULL;
    for (uint64_t p = 0; p < RUNS; p++) I[p + 1] = I[p] + (p < 41 ? p : 5000);
    for (size_t j = 0; weighted && j < N; j++) weight[j] = (float)random_double();
    ck_assert_uint_eq(I[RUNS], N);
    ck_assert_msg(segments_create(N, RUNS, I, weight, &s, &error) == LAM_OK, "%s", error.message);
    return s;
}

/* Sums in double of exact products, rounded once: half a unit of the result, and of double 5000 roundings. */
START_TEST(sums_are_right) {
    segments s = runs(_i);
    float x[N], t[RUNS], first[RUNS];
    for (size_t j = 0; j < N; j++) x[j] = (float)random_double();
    segments_sum(&s, x, first);
    for (cpu_level level = CPU_PORTABLE; level <= cpu_best(); level++) {
        s.kernels = segment_kernels_of(level);
        for (size_t p = 0; p < RUNS; p++) t[p] = NAN;
        segments_sum(&s, x, t);
        for (size_t p = 0; p < RUNS; p++) {
            double truth = 0, magnitude = 0;
            for (uint64_t j = s.begin[p]; j < s.begin[p + 1]; j++) {
                const double term = (s.weight != NULL ? (double)s.weight[j] : 1) * (double)x[j];
                truth += term;
                magnitude += fabs(term);
            }
            ck_assert_msg(fabs((double)t[p] - truth) <= 0x1p-24 * fabs(truth) + 5000 * 0x1p-52 * magnitude,
                          "level %d, run %zu: %.9g, not %.9g", (int)level, p, (double)t[p], truth);
        }
        ck_assert_mem_eq(t, first, sizeof t);
    }
    segments_free(&s);
}
END_TEST

/* Where single precision would stand still: 2^24 and ones, and the sum comes out to the last bit. */
START_TEST(sums_are_in_double) {
    enum { COUNT = 1000 };
    segments s;
    uint64_t *I = calloc(2, sizeof *I);
    float *x = malloc(COUNT * sizeof *x), t = 0;
    I[1] = COUNT;
    x[0] = 0x1p24f;
    for (size_t j = 1; j < COUNT; j++) x[j] = 1;
    ck_assert(segments_create(COUNT, 1, I, NULL, &s, &error) == LAM_OK);
    segments_sum(&s, x, &t);
    ck_assert_float_eq(t, (float)(0x1p24 + COUNT - 1));
    segments_free(&s);
    free(x);
}
END_TEST

START_TEST(spread_is_the_transpose) {
    segments s = runs(_i);
    float t[RUNS], x[N];
    for (size_t p = 0; p < RUNS; p++) t[p] = (float)random_double();
    segments_spread(&s, t, x);
    for (size_t p = 0; p < RUNS; p++)
        for (uint64_t j = s.begin[p]; j < s.begin[p + 1]; j++)
            ck_assert_float_eq(x[j], s.weight != NULL ? s.weight[j] * t[p] : t[p]);
    segments_free(&s);
}
END_TEST

START_TEST(what_is_no_run_is_refused) {
    static const struct {
        uint64_t I[3];
        float weight;
        const char *word;
    } cases[] = {
        {{1, 2, 4}, 1, "I[0] = 1, must be 0"},   {{0, 3, 2}, 1, "I[2] = 2, must be at least 3"},
        {{0, 2, 3}, 1, "I[2] = 3, must be 4"},   {{0, 5, 4}, 1, "I[1] = 5, must be at least 0 and at most 4"},
        {{0, UINT64_MAX, 4}, 1, "I[1]"},         {{0, 2, 4}, NAN, "weight[3] = nan"},
        {{0, 2, 4}, INFINITY, "weight[3] = inf"}};
    uint64_t I[3];
    float weight[4] = {1, 1, 1, cases[_i].weight};
    segments s = {.n = 77};
    memcpy(I, cases[_i].I, sizeof I);
    ck_assert_int_eq(segments_create(4, 2, I, weight, &s, &error), LAM_ERR_NUMERIC);
    ck_assert_msg(strstr(error.message, cases[_i].word) != NULL, "no '%s' in %s", cases[_i].word,
                  error.message);
    ck_assert_uint_eq(s.n, 77);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("segments");
    TCase *tests = tcase_create("segments");
    tcase_set_timeout(tests, 120);
    tcase_add_loop_test(tests, sums_are_right, 0, 2);
    tcase_add_test(tests, sums_are_in_double);
    tcase_add_loop_test(tests, spread_is_the_transpose, 0, 2);
    tcase_add_loop_test(tests, what_is_no_run_is_refused, 0, 7);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
