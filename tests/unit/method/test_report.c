/* The report of a build in words. */
#include "solver/method/report.h"
#include "support/suite.h"

#include <string.h>

START_TEST(figures_have_words_and_units) {
    build_report report = {.method = "none"};
    char line[512];
    report_text(&report, "assign", "inclusion");
    report_number(&report, "patch_area_min", .0035);
    report_count(&report, "rank", 163687);
    report_number(&report, "measured_norm_error", .04834);
    report_line(&report, line, sizeof line);
    ck_assert_str_eq(line,
                     "elements join patches by inclusion, smallest area of a patch 0.0035 m2, rank 163687, "
                     "measured norm error 0.0483");
}
END_TEST

/* A short line ends within the text, wherever it ends, and no byte behind it is written. */
START_TEST(a_short_line_is_cut) {
    build_report report = {.method = "none"};
    char whole[64], line[64];
    report_count(&report, "rank", 24);
    report_text(&report, "norm", "2");
    report_line(&report, whole, sizeof whole);
    for (size_t size = 1; size <= strlen(whole); size++) {
        memset(line, '!', sizeof line);
        report_line(&report, line, size);
        ck_assert_int_eq(memcmp(line, whole, size - 1), 0);
        ck_assert(line[size - 1] == '\0' && line[size] == '!');
    }
}
END_TEST

START_TEST(unknown_names_have_no_words) {
    ck_assert_ptr_null(report_words_of("ray_seed"));
    ck_assert_str_eq(report_words_of("rcond")->label, "reciprocal condition number");
}
END_TEST

int main(void) {
    Suite *suite = suite_create("report");
    TCase *cases = tcase_create("report");
    tcase_add_test(cases, figures_have_words_and_units);
    tcase_add_test(cases, a_short_line_is_cut);
    tcase_add_test(cases, unknown_names_have_no_words);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
