/* Direct light of many sources: sums in their order, whatever stands beside a result, against plain loops. */
#include "solver/operator/first_rows.h"
#include "support/suite.h"

#include <math.h>
#include <string.h>

enum { N = 1111, M = 300, ROWS = 19, CHANNELS = 3 };

static float next(uint32_t *state) {
    *state = *state * 1664525u + 1013904223u;
    return (float)(*state >> 8) * 0x1p-24f;
}

/* By _i the weights are those of hours (all above 0), of tiles (one of them) or of lamps (some). */
START_TEST(results_are_sums_in_order) {
    static float values[M * N], w[ROWS * M], H0[ROWS * N], before[ROWS * N], one[N];
    static double f[CHANNELS * M];
    static const size_t sizes[][3] = {{1, 1, 1},    {5, 3, 2},      {16, 145, 8},  {100, 7, 9},
                                      {511, 33, 4}, {513, 256, 16}, {529, 257, 3}, {N, M, ROWS}};
    const row_factors colours = {CHANNELS, f};
    uint32_t state = 1;
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        const size_t n = sizes[k][0], m = sizes[k][1], n_rows = sizes[k][2];
        const bool add = k % 2 == 1, coloured = k % 3 == 1;
        first_rows r;
        lam_error error;
        for (size_t i = 0; i < m * n; i++) values[i] = next(&state);
        for (size_t i = 0; i < CHANNELS * m; i++) f[i] = (double)next(&state);
        for (size_t i = 0; i < n_rows * m; i++) {
            const bool matters = _i == 0 || (_i == 1 ? i % m == i / m : i % 5 == 0);
            w[i] = matters ? next(&state) : 0;
        }
        for (size_t i = 0; i < n_rows * n; i++) before[i] = H0[i] = add ? next(&state) : NAN;
        ck_assert_int_eq(first_rows_copy(m, n, values, &r, &error), LAM_OK);
        first_rows_apply(&r, n_rows, w, coloured ? &colours : NULL, add, H0);
        for (size_t q = 0; q < n_rows; q++) {
            for (size_t i = 0; i < n; i++) {
                double sum = 0;
                for (size_t t = 0; t < m; t++)
                    sum += (double)w[q * m + t] * (coloured ? f[q % CHANNELS * m + t] : 1) *
                           (double)values[t * n + i];
                const double wanted = sum + (add ? (double)before[q * n + i] : 0);
                /* Half a unit of float, and m sums of double that may be contracted. */
                ck_assert_double_le(fabs((double)H0[q * n + i] - wanted),
                                    wanted * (0x1p-24 + (double)m * 0x1p-52));
            }
            /* A result alone has the same bits; its channel would then be another. */
            if (coloured) continue;
            for (size_t i = 0; i < n; i++) one[i] = before[q * n + i];
            first_rows_apply(&r, 1, w + q * m, NULL, add, one);
            ck_assert_int_eq(memcmp(one, H0 + q * n, n * sizeof *one), 0);
        }
        first_rows_free(&r);
    }
}
END_TEST

int main(void) {
    Suite *suite = suite_create("first_rows");
    TCase *tests = tcase_create("first_rows");
    tcase_add_loop_test(tests, results_are_sums_in_order, 0, 3);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
