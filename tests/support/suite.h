/* The main() of every libcheck program: runs a suite, fails when it holds no test. */
#ifndef LAMBERT_TESTS_SUITE_H
#define LAMBERT_TESTS_SUITE_H

#include <check.h>
#include <stdio.h>
#include <stdlib.h>

/* ck_assert for inner loops: of each of those that hold libcheck sends word to the process that forked the
 * test, which under a sanitizer costs more than what is tested. */
#define ck_each(condition) ((condition) ? (void)0 : ck_abort_msg("Assertion '%s' failed", #condition))

/* Runs a suite; the exit status. */
static inline int suite_run(Suite *suite) {
    SRunner *runner = srunner_create(suite);
    srunner_run_all(runner, CK_NORMAL);
    int run = srunner_ntests_run(runner), failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    if (run == 0) fprintf(stderr, "no test was run\n");
    return run > 0 && failed == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}

#endif
