/* Every operator kind names itself, its sizes and its density as they are. */
#include "support/suite.h"
#include "support/transport.h"

#include <string.h>

START_TEST(says_what_it_is) {
    const transport *t = transport_kept(_i);
    operator_description description;
    operator_describe(t->op, &description);
    const bool sparse = strcmp(t->kind, "sparse") == 0, two_mesh = strcmp(t->kind, "two_mesh") == 0;
    const bool factors = two_mesh || strcmp(t->kind, "low_rank") == 0;
    ck_assert_uint_eq(lam_operator_elements(t->op), t->n);
    ck_assert_uint_eq(lam_operator_channels(t->op), t->n_channels);
    ck_assert_str_eq(lam_operator_kind(t->op), t->kind);
    ck_assert_ptr_eq(operator_kind_find(lam_operator_kind(t->op)), t->op->kind);
    ck_assert_uint_eq(lam_operator_bytes(t->op), description.bytes);
    ck_assert_uint_eq(description.rank, factors ? t->k : 0);
    if (sparse) {
        const size_t stored = (size_t)(description.density * (double)(t->n_channels * t->n * t->n) + .5);
        ck_assert_double_eq_tol(description.density, .33, .03);
        ck_assert_ptr_null(description.form);
        ck_assert_ptr_null(description.precision);
        ck_assert_uint_ge(description.bytes, 8 * stored);
    } else if (strcmp(t->kind, "hierarchical") == 0) {
        const size_t stored = (size_t)(description.density * (double)(t->n_channels * t->n * t->n) + .5);
        ck_assert_double_eq_tol(description.density, .05, .02);
        ck_assert_ptr_null(description.form);
        ck_assert_str_eq(description.precision, "i8");
        /* Two of three channels that are alike share their numbers. */
        const size_t own = strstr(t->name, "alike") != NULL ? stored * 2 / 3 : stored;
        ck_assert_uint_ge(description.bytes, 12 * own / 9); /* nine numbers of a tile, with its column */
    } else if (strcmp(t->kind, "exact") == 0) {
        ck_assert_double_eq(description.density, 1);
        ck_assert_ptr_null(description.form);
        ck_assert_uint_ge(description.bytes, t->n_channels * t->n * t->n * sizeof(float));
    } else if (factors) {
        ck_assert_double_lt(description.density, 0);
        const bool folded = strstr(t->name, "folded") != NULL;
        ck_assert_str_eq(description.form, folded ? "folded" : "factored");
        ck_assert_uint_ge(description.bytes,
                          (two_mesh ? 1 : 2) * t->n * t->k * panel_value_size(t->precision));
        if (two_mesh && folded && t->precision == PANEL_F32)
            ck_assert_uint_lt(description.bytes, 2 * t->n * t->k * sizeof(float));
        ck_assert_str_eq(description.precision, panel_precision_name(t->precision));
    }
    /* A batch is cut into passes, so that its work area stays bounded. */
    ck_assert_uint_eq(lam_operator_work_bytes(t->op, OPERATOR_PASS),
                      lam_operator_work_bytes(t->op, SIZE_MAX));
}
END_TEST

int main(void) {
    Suite *suite = suite_create("operator description");
    TCase *tests = tcase_create("description");
    tcase_set_timeout(tests, 300);
    tcase_add_unchecked_fixture(tests, transport_keep_all, transport_free_all);
    tcase_add_loop_test(tests, says_what_it_is, 0, TRANSPORTS);
    suite_add_tcase(suite, tests);
    return suite_run_together(suite);
}
