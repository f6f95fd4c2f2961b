/* The process that reads the headers of a store may crash, hang, have too much to say or lie: each ends in
 * one line about the file. It has the file, the pipe and no right to anything else. */
#include "store/store_private.h"
#include "support/store_sample.h"
#include "support/suite.h"

#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>

static char folder[64], path[128];
static lam_error error;
static size_t file_size;

static const confined_limits limits = {
    .cpu_seconds = 20, .all_seconds = 30, .memory_bytes = (size_t)512 << 20, .filtered = true};

/* A sample with a group that keeps the order of its links, as no store of ours does, so that HDF5 is to read
 * its headers. */
static void write_odd(const char *to, uint64_t salt) {
    store *s = NULL;
    ck_ok(store_create(to, &s, &error));
    ck_ok(sample_fill(s, salt, &error));
    const hid_t creation = H5Pcreate(H5P_GROUP_CREATE);
    ck_assert_int_ge(H5Pset_link_creation_order(creation, H5P_CRT_ORDER_TRACKED), 0);
    const hid_t group = H5Gcreate2(s->h5, "/odd", H5P_DEFAULT, creation, H5P_DEFAULT);
    ck_assert(group >= 0);
    H5Gclose(group);
    H5Pclose(creation);
    ck_ok(store_seal(s, &error));
}

static void setup(void) {
    sample_folder(folder);
    snprintf(path, sizeof path, "%s/sample.h5", folder);
    memset(&error, 0, sizeof error);
    write_odd(path, 1);
    free(sample_load(path, &file_size));
}

static void teardown(void) {
    sample_folder_remove(folder);
}

/* Opens by a child of this kind, which must be refused by this status and these words. */
static void check_refused(confined_main *run, const confined_limits *with, lam_status expected,
                          const char *words) {
    store *s = NULL;
    const int before = open("/dev/null", O_RDONLY);
    const lam_status status = store_open_by(path, run, with, &s, &error);
    ck_assert_msg(status == expected, "%s: %s", lam_status_text(status), error.message);
    ck_assert_msg(strncmp(error.message, path, strlen(path)) == 0 && strstr(error.message, words) != NULL &&
                      strpbrk(error.message, "\r\n") == NULL,
                  "%s", error.message);
    ck_assert_ptr_null(s);
    /* Neither a descriptor nor a process is left. */
    const int after = open("/dev/null", O_RDONLY);
    ck_assert_int_eq(after, before + 1);
    close(before);
    close(after);
    ck_assert(waitpid(-1, NULL, WNOHANG) == -1 && errno == ECHILD);
}

static void crash(void *context) {
    (void)context;
    signal(SIGSEGV, SIG_DFL);
    raise(SIGSEGV);
}

static void be_killed(void *context) {
    (void)context;
    raise(SIGKILL);
}

static void say_nothing(void *context) {
    (void)context;
}

static void end_early(void *context) {
    (void)context;
    const reply_head head = {.magic = REPLY_MAGIC, .n_objects = 1, .bytes = 1000};
    (void)confined_send(CONFINED_REPLY, &head, sizeof head);
}

static void send_noise(void *context) {
    (void)context;
    char noise[4096];
    memset(noise, 'x', sizeof noise);
    while (confined_send(CONFINED_REPLY, noise, sizeof noise)) continue;
}

/* A child that ends in its own way is started three times: what the system did to one hardly happens to
 * three. raise() sends a signal to itself, which the filter does not allow. */
START_TEST(crashes_are_refused) {
    static const struct {
        confined_main *run;
        const char *words;
    } cases[] = {{crash, "cannot read its headers"},
                 {be_killed, "cannot read its headers"},
                 {say_nothing, "cannot read its headers"},
                 {end_early, "cannot read its headers"},
                 {send_noise, "answered nonsense"}};
    confined_limits free_to_raise = limits;
    free_to_raise.filtered = false;
    check_refused(cases[_i].run, &free_to_raise, LAM_ERR_DAMAGED, cases[_i].words);
}
END_TEST

static void sleep_long(void *context) {
    (void)context;
    for (;;) pause();
}

static void compute_long(void *context) {
    (void)context;
    for (volatile unsigned k = 0;; k++) continue;
}

/* It sends all that is asked, then goes on living. */
static void live_on(void *context) {
    store *s = context;
    s->file.fd = CONFINED_INPUT;
    store_headers_send(s, CONFINED_REPLY);
    for (;;) pause();
}

START_TEST(what_does_not_end_is_ended) {
    confined_limits short_time = limits;
    short_time.all_seconds = 1;
    check_refused(sleep_long, &short_time, LAM_ERR_DAMAGED, "cannot read its headers");
    short_time = limits;
    short_time.cpu_seconds = 1;
    check_refused(compute_long, &short_time, LAM_ERR_DAMAGED, "cannot read its headers");
    store *s = NULL;
    confined_limits may_pause = limits;
    may_pause.filtered = false;
    ck_ok(store_open_by(path, live_on, &may_pause, &s, &error));
    ck_ok(store_verify(s, &error));
    store_close(s);
    ck_assert(waitpid(-1, NULL, WNOHANG) == -1 && errno == ECHILD);
}
END_TEST

/* Stops once it was asked so often. */
typedef struct patience {
    size_t asked, most;
} patience;

static bool is_over(void *context) {
    patience *p = context;
    return ++p->asked > p->most;
}

/* A child that takes long is ended as soon as nobody waits for it any more, and so is the reading of arrays,
 * between two MiB. */
START_TEST(what_is_not_waited_for_is_left) {
    patience p = {.most = 2};
    const stop_check stop = {is_over, &p};
    confined_limits stopped = limits;
    stopped.stop = &stop;
    check_refused(sleep_long, &stopped, LAM_ERR_CANCELLED, "not read to its end");
    ck_assert_uint_eq(p.asked, 3);
    p = (patience){.most = SIZE_MAX};
    store *s = NULL;
    ck_ok(store_open_within(path, UINT64_MAX, &stop, &s, &error));
    p = (patience){.most = 3};
    ck_assert(store_verify(s, &error) == LAM_ERR_CANCELLED);
    ck_assert_uint_eq(p.asked, 4);
    store_close(s);
}
END_TEST

/* A process that may have no children: of an ordinary user, since root may have any number. Afterwards it is
 * as before, as a sanitizer starts a thread when it ends. */
START_TEST(without_a_child_only_plain_stores_are_opened) {
    store *s = NULL, *plain = NULL;
    char other[160];
    struct rlimit before;
    const bool root = geteuid() == 0;
    snprintf(other, sizeof other, "%s/other.h5", folder);
    ck_ok(sample_write(other, 1, &error));
    ck_assert_int_eq(chmod(folder, 0755), 0);
    ck_assert_int_eq(getrlimit(RLIMIT_NPROC, &before), 0);
    ck_assert_int_eq(setrlimit(RLIMIT_NPROC, &(struct rlimit){0, before.rlim_max}), 0);
    if (root) ck_assert_int_eq(setresuid(65534, 65534, 0), 0);
    const lam_status status = store_open(path, &s, &error);
    lam_error none = {.message = ""};
    const lam_status by_itself = store_open(other, &plain, &none);
    if (root) ck_assert_int_eq(setresuid(0, 0, 0), 0);
    ck_assert_int_eq(setrlimit(RLIMIT_NPROC, &before), 0);
    ck_assert_int_eq(prctl(PR_SET_DUMPABLE, 1), 0);
    ck_assert_int_eq(status, LAM_ERR_IO);
    ck_assert_msg(strstr(error.message, "no process can be started") != NULL, "%s", error.message);
    ck_assert_msg(by_itself == LAM_OK, "%s", none.message);
    store_close(plain);
}
END_TEST

/* The system keeps no exit status of a child while SIGCHLD is ignored. */
START_TEST(an_unknown_end_is_refused) {
    confined_limits free_to_raise = limits;
    free_to_raise.filtered = false;
    signal(SIGCHLD, SIG_IGN);
    check_refused(crash, &free_to_raise, LAM_ERR_IO, "do not ignore SIGCHLD");
    signal(SIGCHLD, SIG_DFL);
}
END_TEST

/* Tells by its refusal which of its rights are too many. */
static void look_around(void *context) {
    (void)context;
    reply_head head = {.magic = REPLY_MAGIC, .status = LAM_ERR_FORMAT};
    sigset_t blocked;
    struct sigaction action;
    int descriptors = 0, handled = 0, masked = 0;
    for (int fd = 0; fd < 1024; fd++) descriptors += fcntl(fd, F_GETFD) >= 0;
    sigprocmask(SIG_BLOCK, NULL, &blocked);
    for (int number = 1; number < NSIG; number++) {
        masked += sigismember(&blocked, number) == 1;
        handled += sigaction(number, NULL, &action) == 0 && action.sa_handler != SIG_DFL;
    }
#ifdef LAMBERT_SANITIZED /* has neither filter nor limit of memory */
    const int opened = 0, sockets = 0, killed = 0, children = 0, large = 0;
#else
    const int opened = open("/etc/passwd", O_RDONLY) >= 0;
    const int sockets = socket(AF_INET, SOCK_STREAM, 0) >= 0 || socket(AF_UNIX, SOCK_STREAM, 0) >= 0;
    const int killed = kill(getppid(), 0) == 0, children = fork() >= 0;
    void *volatile memory = malloc((size_t)1 << 30);
    const int large = memory != NULL;
#endif
    snprintf(
        head.message, sizeof head.message,
        "%s: %d descriptors, %d handled, %d masked, %d opened, %d sockets, %d killed, %d children, %d large",
        path, descriptors, handled, masked, opened, sockets, killed, children, large);
    (void)confined_send(CONFINED_REPLY, &head, sizeof head);
}

static void ignore(int number) {
    (void)number;
}

START_TEST(it_has_no_rights) {
    sigset_t all;
    sigfillset(&all);
    sigprocmask(SIG_BLOCK, &all, NULL);
    signal(SIGHUP, ignore);
    signal(SIGPIPE, SIG_IGN);
    int sockets[2];
    ck_assert_int_eq(socketpair(AF_UNIX, SOCK_STREAM, 0, sockets), 0);
    store *s = NULL;
    ck_assert_int_eq(store_open_by(path, look_around, &limits, &s, &error), LAM_ERR_FORMAT);
    const char *seen = strstr(error.message, ": ");
    ck_assert_ptr_nonnull(seen);
    ck_assert_str_eq(seen, ": 5 descriptors, 0 handled, 0 masked, 0 opened, 0 sockets, 0 killed, 0 children, "
                           "0 large");
}
END_TEST

/* Standard streams that are closed give their numbers to the file and the pipe. */
START_TEST(closed_streams_do_no_harm) {
    store *s = NULL;
    const int kept = dup(STDERR_FILENO);
    for (int fd = 0; fd < 3; fd++) close(fd);
    const lam_status status = store_open(path, &s, &error);
    ck_assert_int_eq(dup2(kept, STDERR_FILENO), STDERR_FILENO);
    ck_ok(status);
    ck_ok(store_verify(s, &error));
    store_close(s);
}
END_TEST

/* The child lets another file take the place of this one, in the middle of opening. */
static void replace_then_send(void *context) {
    char other[160];
    snprintf(other, sizeof other, "%s/other.h5", folder);
    if (rename(other, path) == 0) live_on(context);
}

START_TEST(the_file_that_was_read_is_the_one_opened) {
    char other[160];
    store *s = NULL;
    uint64_t first = 0, second = 0, seen = 0;
    confined_limits may_rename = limits;
    may_rename.filtered = false;
    snprintf(other, sizeof other, "%s/other.h5", folder);
    write_odd(other, 2);
    ck_ok(sample_read(path, &first, &error));
    ck_ok(store_open_by(path, replace_then_send, &may_rename, &s, &error));
    ck_ok(sample_read_open(s, &seen, &error));
    ck_assert_uint_eq(seen, first);
    store_close(s);
    ck_ok(sample_read(path, &second, &error));
    ck_assert_uint_ne(second, first);
}
END_TEST

/* HDF5 is called by the process that makes a store, and by children. */
static pid_t reader;

static void count_call(void) {
    if (getpid() == reader) abort();
}

hid_t H5Fopen(const char *name, unsigned flags, hid_t access) {
    union {
        void *symbol;
        hid_t (*call)(const char *, unsigned, hid_t);
    } real = {.symbol = dlsym(RTLD_NEXT, "H5Fopen")};
    count_call();
    return real.call(name, flags, access);
}

/* Each function of HDF5 is called between one of this and another. */
herr_t H5Eset_auto2(hid_t stack, H5E_auto2_t print, void *context) {
    union {
        void *symbol;
        herr_t (*call)(hid_t, H5E_auto2_t, void *);
    } real = {.symbol = dlsym(RTLD_NEXT, "H5Eset_auto2")};
    count_call();
    return real.call(stack, print, context);
}

static void *wait_for_it(void *lock) {
    pthread_mutex_lock(lock);
    pthread_mutex_unlock(lock);
    return NULL;
}

/* Also beside other threads, where a sanitizer starts the program afresh. */
START_TEST(a_reader_never_calls_hdf5) {
    pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
    pthread_t thread;
    uint64_t expected = 0, seen = 0;
    reader = getpid();
    ck_ok(sample_read(path, &expected, &error));
    pthread_mutex_lock(&lock);
    ck_assert_int_eq(pthread_create(&thread, NULL, wait_for_it, &lock), 0);
    ck_ok(sample_read(path, &seen, &error));
    ck_assert_uint_eq(seen, expected);
    pthread_mutex_unlock(&lock);
    pthread_join(thread, NULL);
}
END_TEST

enum { THREADS = 8, ROUNDS = 10 };

static void *read_often(void *out) {
    uint64_t *reading = out;
    lam_error why;
    for (int k = 0; k < ROUNDS; k++) {
        uint64_t seen = 0;
        if (sample_read(path, &seen, &why) != LAM_OK || (k > 0 && seen != *reading)) seen = UINT64_MAX;
        *reading = seen;
    }
    return NULL;
}

START_TEST(threads_open_stores_at_once) {
    pthread_t threads[THREADS];
    uint64_t expected = 0, seen[THREADS] = {0};
    ck_ok(sample_read(path, &expected, &error));
    for (int k = 0; k < THREADS; k++)
        ck_assert_int_eq(pthread_create(&threads[k], NULL, read_often, &seen[k]), 0);
    for (int k = 0; k < THREADS; k++) {
        pthread_join(threads[k], NULL);
        ck_assert_uint_eq(seen[k], expected);
    }
}
END_TEST

int main(void) {
    Suite *suite = suite_create("store child");
    TCase *tests = tcase_create("child");
    tcase_set_timeout(tests, 120);
    tcase_add_checked_fixture(tests, setup, teardown);
    tcase_add_loop_test(tests, crashes_are_refused, 0, 5);
    tcase_add_test(tests, what_does_not_end_is_ended);
    tcase_add_test(tests, what_is_not_waited_for_is_left);
    tcase_add_test(tests, without_a_child_only_plain_stores_are_opened);
    tcase_add_test(tests, an_unknown_end_is_refused);
    tcase_add_test(tests, it_has_no_rights);
    tcase_add_test(tests, closed_streams_do_no_harm);
    tcase_add_test(tests, the_file_that_was_read_is_the_one_opened);
    tcase_add_test(tests, a_reader_never_calls_hdf5);
    tcase_add_test(tests, threads_open_stores_at_once);
    suite_add_tcase(suite, tests);
    return suite_run_apart(suite);
}
