/* Living through a mapped file that is cut short. */
#include "server/scene/map_guard.h"
#include "support/suite.h"

#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

enum { PAGES = 8 };

static size_t page;
static int fd;
static char *mapping;

/* A file of so many pages of 'x', mapped; its name is gone at once. */
static void setup(void) {
    char path[] = "/tmp/map_guard_XXXXXX";
    page = (size_t)sysconf(_SC_PAGESIZE);
    char *content = malloc(PAGES * page);
    memset(content, 'x', PAGES * page);
    fd = mkstemp(path);
    unlink(path);
    ck_assert(write(fd, content, PAGES * page) == (ssize_t)(PAGES * page));
    free(content);
    mapping = mmap(NULL, PAGES * page, PROT_READ, MAP_SHARED, fd, 0);
    ck_assert_ptr_ne(mapping, MAP_FAILED);
    map_guard_install();
}

static void teardown(void) {
    munmap(mapping, PAGES * page);
    close(fd);
}

static char read_at(size_t at) {
    return *(volatile char *)(mapping + at);
}

START_TEST(what_is_gone_reads_as_zeros) {
    size_t offset = 1;
    map_range *range = map_guard_add(mapping, PAGES * page);
    ck_assert_ptr_nonnull(range);
    ck_assert_int_eq(read_at(5 * page), 'x');
    ck_assert(!map_guard_lost(range, &offset));
    ck_assert_int_eq(ftruncate(fd, (off_t)(3 * page)), 0);
    ck_assert_int_eq(read_at(2 * page), 'x'); /* still there */
    ck_assert(!map_guard_lost(range, &offset));
    ck_assert_int_eq(read_at(5 * page + 7), 0);
    ck_assert(map_guard_lost(range, &offset));
    ck_assert_uint_eq(offset, 5 * page);
    ck_assert_int_eq(read_at(4 * page), 0); /* before the first fault: another */
    ck_assert_int_eq(read_at(PAGES * page - 1), 0);
    ck_assert(map_guard_lost(range, &offset));
    ck_assert_uint_eq(offset, 5 * page); /* the first that was touched */
    ck_assert_int_eq(read_at(0), 'x');
    map_guard_remove(range);
}
END_TEST

START_TEST(ranges_differ) {
    size_t offset = 1;
    map_range *low = map_guard_add(mapping, 2 * page), *high = map_guard_add(mapping + 2 * page, 6 * page);
    ck_assert_int_eq(ftruncate(fd, 0), 0);
    ck_assert_int_eq(read_at(3 * page), 0);
    ck_assert(!map_guard_lost(low, &offset));
    ck_assert(map_guard_lost(high, &offset));
    ck_assert_uint_eq(offset, page);
    ck_assert_int_eq(read_at(0), 0);
    ck_assert(map_guard_lost(low, &offset));
    map_guard_remove(low);
    map_guard_remove(high);
    /* A place that is free again knows nothing of what was lost. */
    low = map_guard_add(mapping, page);
    ck_assert(!map_guard_lost(low, &offset));
    map_guard_remove(low);
    ck_assert(!map_guard_lost(NULL, &offset));
}
END_TEST

static void *read_in_thread(void *context) {
    map_guard_allow();
    for (size_t p = 0; p < PAGES; p++) ck_assert_int_eq(read_at(p * page), 0);
    return context;
}

/* Threads of the daemon are born with all signals blocked. */
START_TEST(threads_that_block_signals_live_too) {
    sigset_t all, before;
    pthread_t threads[4];
    map_range *range = map_guard_add(mapping, PAGES * page);
    ck_assert_int_eq(ftruncate(fd, 0), 0);
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    for (int i = 0; i < 4; i++) ck_assert_int_eq(pthread_create(&threads[i], NULL, read_in_thread, NULL), 0);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    for (int i = 0; i < 4; i++) pthread_join(threads[i], NULL);
    map_guard_remove(range);
}
END_TEST

START_TEST(a_fault_elsewhere_ends_the_process) {
    map_range *range = map_guard_add(mapping, PAGES * page);
    map_guard_remove(range); /* from here on nobody guards it */
    ck_assert_int_eq(ftruncate(fd, 0), 0);
    (void)read_at(0);
}
END_TEST

START_TEST(a_signal_that_was_sent_ends_the_process) {
    (void)map_guard_add(mapping, PAGES * page);
    raise(SIGBUS);
    raise(SIGBUS);
}
END_TEST

START_TEST(places_run_out) {
    static map_range *taken[MAP_GUARD_RANGES];
    for (size_t i = 0; i < MAP_GUARD_RANGES; i++) {
        taken[i] = map_guard_add(mapping, page);
        if (taken[i] == NULL) ck_abort_msg("no place %zu", i);
    }
    ck_assert_ptr_null(map_guard_add(mapping, page));
    map_guard_remove(taken[7]);
    ck_assert_ptr_eq(map_guard_add(mapping, page), taken[7]);
    for (size_t i = 0; i < MAP_GUARD_RANGES; i++) map_guard_remove(taken[i]);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("map_guard");
    TCase *tests = tcase_create("map_guard");
    tcase_add_checked_fixture(tests, setup, teardown);
    tcase_add_test(tests, what_is_gone_reads_as_zeros);
    tcase_add_test(tests, ranges_differ);
    tcase_add_test(tests, threads_that_block_signals_live_too);
    tcase_add_test_raise_signal(tests, a_fault_elsewhere_ends_the_process, SIGBUS);
    tcase_add_test_raise_signal(tests, a_signal_that_was_sent_ends_the_process, SIGBUS);
    tcase_add_test(tests, places_run_out);
    suite_add_tcase(suite, tests);
    return suite_run_apart(suite);
}
