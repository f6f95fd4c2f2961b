/* Numbers at the end of the range of a panel, and matrices that no panel takes. */
#include "solver/linalg/panel.h"
#include "support/suite.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

/* Values beyond f16 are scaled, never infinite. Columns of zeros stay. */
START_TEST(extremes_are_kept) {
    lam_error error = {.message = ""};
    const float rows[] = {3.4e38f, 1e-30f, 0, 2e5f, -3.3e38f, -2e-31f, 0, 6e4f};
    panel wide, a = {.n = 7};
    ck_assert(panel_create(2, 4, rows, "Y", &wide, &error) == LAM_OK);
    for (int p = 0; p < 2; p++) {
        float back[8];
        ck_assert(panel_convert(&wide, p == 0 ? PANEL_F16 : PANEL_I8, "Y", &a, &error) == LAM_OK);
        panel_copy_rows(&a, back);
        for (size_t at = 0; at < 8; at++)
            ck_assert_double_le(fabs((double)back[at] - (double)rows[at]),
                                (p == 0 ? 0x1p-11 : .0040) *
                                    fmax(fabs((double)rows[at]), fabs((double)rows[at % 4])));
        panel_free(&a);
    }
    panel_free(&wide);
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
    Suite *suite = suite_create("panel bounds");
    TCase *tests = tcase_create("panel bounds");
    tcase_add_test(tests, extremes_are_kept);
    tcase_add_test(tests, bad_matrices_are_refused);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
