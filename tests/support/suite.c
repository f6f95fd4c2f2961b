#include "support/suite.h"

static int run_by(Suite *suite, enum fork_status how) {
    SRunner *runner = srunner_create(suite);
    srunner_set_fork_status(runner, how);
    srunner_run_all(runner, CK_NORMAL);
    int run = srunner_ntests_run(runner), failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    if (run == 0) fprintf(stderr, "no test was run\n");
    return run > 0 && failed == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}

int suite_run(Suite *suite) {
    return run_by(suite, CK_FORK_GETENV);
}

int suite_run_together(Suite *suite) {
    return run_by(suite, CK_NOFORK);
}

int suite_run_apart(Suite *suite) {
    return run_by(suite, CK_FORK);
}
