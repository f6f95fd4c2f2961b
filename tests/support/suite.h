/* For the main() of a test file: it runs a suite, and fails when it holds no test; and checks of libcheck. */
#ifndef LAMBERT_TESTS_SUITE_H
#define LAMBERT_TESTS_SUITE_H

#include <check.h>
#include <stdio.h>
#include <stdlib.h>

/* All checks of libcheck expand to ck_assert_msg. Its own also writes a message to the process that forked
 * the test when a check holds, which in inner loops costs more than the code under test. */
#undef ck_assert_msg
#define ck_assert_msg(condition, ...)                                                                        \
    ((condition) ? (void)0                                                                                   \
                 : _ck_assert_failed(__FILE__, __LINE__, "Assertion '" #condition "' failed", __VA_ARGS__))

/* Asserts success of a call that sets the test's own `error`. */
#define ck_ok(call) ck_assert_msg((call) == LAM_OK, "%s", error.message)

/* The files of a room are one program (program.h), for which the build names the main() of each test_NAME. */
int main(void);

/* Runs a suite; the exit status. */
int suite_run(Suite *suite);

/* The same in one process: an unchecked fixture has run threads of OpenMP, and a process that is forked after
 * that waits for them for ever. */
int suite_run_together(Suite *suite);

/* The same with a process for each check, whatever CK_FORK says: some of them end theirs. */
int suite_run_apart(Suite *suite);

#endif
