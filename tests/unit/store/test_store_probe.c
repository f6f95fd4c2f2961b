/* A file that ends whoever opens it ends a child of ours, and is refused; any other is for the caller to
 * open. */
#include "store/store_private.h"
#include "support/suite.h"

#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

static lam_status crash(const char *path, store **out, lam_error *error) {
    (void)path;
    (void)out;
    (void)error;
    raise(SIGKILL);
    return LAM_OK;
}

static lam_status end_the_process(const char *path, store **out, lam_error *error) {
    (void)path;
    (void)out;
    (void)error;
    exit(3);
}

static lam_status refuse(const char *path, store **out, lam_error *error) {
    (void)out;
    return status_fail(error, LAM_ERR_FORMAT, "%s: not a store", path);
}

START_TEST(what_crashes_is_refused) {
    static store_opener *const openers[] = {crash, end_the_process};
    lam_error error = {.message = ""};
    ck_assert_int_eq(store_probe(openers[_i], "a.h5", &error), LAM_ERR_DAMAGED);
    ck_assert_str_eq(error.message,
                     "a.h5: damaged so that HDF5 cannot read its headers; make the store again");
}
END_TEST

START_TEST(what_is_refused_is_for_the_caller) {
    lam_error error = {.message = "as before"};
    ck_assert_int_eq(store_probe(refuse, "a.h5", &error), LAM_OK);
    ck_assert_str_eq(error.message, "as before");
}
END_TEST

/* A process that may have no children: of an ordinary user, since root may have any number. Afterwards it is
 * as before, as a sanitizer starts a thread when it ends. */
START_TEST(without_a_child_nothing_is_opened) {
    lam_error error = {.message = ""};
    struct rlimit before;
    const bool root = geteuid() == 0;
    ck_assert_int_eq(getrlimit(RLIMIT_NPROC, &before), 0);
    ck_assert_int_eq(setrlimit(RLIMIT_NPROC, &(struct rlimit){0, before.rlim_max}), 0);
    if (root) ck_assert_int_eq(setresuid(65534, 65534, 0), 0);
    const lam_status status = store_probe(refuse, "a.h5", &error);
    if (root) ck_assert_int_eq(setresuid(0, 0, 0), 0);
    ck_assert_int_eq(setrlimit(RLIMIT_NPROC, &before), 0);
    ck_assert_int_eq(prctl(PR_SET_DUMPABLE, 1), 0);
    ck_assert_int_eq(status, LAM_ERR_IO);
    ck_assert_msg(strstr(error.message, "a.h5: no process can be started") != NULL, "%s", error.message);
}
END_TEST

/* The system keeps no exit status of a child while SIGCHLD is ignored. */
START_TEST(an_unknown_end_is_refused) {
    lam_error error = {.message = ""};
    signal(SIGCHLD, SIG_IGN);
    const lam_status status = store_probe(crash, "a.h5", &error);
    signal(SIGCHLD, SIG_DFL);
    ck_assert_int_eq(status, LAM_ERR_IO);
    ck_assert_msg(strstr(error.message, "do not ignore SIGCHLD") != NULL, "%s", error.message);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("store probe");
    TCase *tests = tcase_create("probe");
    tcase_add_loop_test(tests, what_crashes_is_refused, 0, 2);
    tcase_add_test(tests, what_is_refused_is_for_the_caller);
    tcase_add_test(tests, without_a_child_nothing_is_opened);
    tcase_add_test(tests, an_unknown_end_is_refused);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
