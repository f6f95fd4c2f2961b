/* The main() of every libcheck program: runs a suite, fails when it holds no test. */
#ifndef LAMBERT_TESTS_SUITE_H
#define LAMBERT_TESTS_SUITE_H

#include <check.h>
#include <stdio.h>
#include <stdlib.h>

/* ck_assert for inner loops: of each of those that hold libcheck sends word to the process that forked the
 * test, which under a sanitizer costs more than what is tested. */
#define ck_each(condition) ((condition) ? (void)0 : ck_abort_msg("Assertion '%s' failed", #condition))

/* Of a call that sets the test's own `error`. */
#define ck_ok(call) ck_assert_msg((call) == LAM_OK, "%s", error.message)

/* Runs a suite; the exit status. */
int suite_run(Suite *suite);

#endif
