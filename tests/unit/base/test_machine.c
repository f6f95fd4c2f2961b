/* Limits of control groups of either version, from folders that look like those of the system. */
#include "solver/base/machine.h"
#include "support/suite.h"

#include <ftw.h>
#include <math.h>
#include <string.h>
#include <sys/stat.h>

static char root[] = "/tmp/machine.XXXXXX";

static void open_root(void) {
    memcpy(root + sizeof root - 7, "XXXXXX", 6);
    ck_assert_ptr_nonnull(mkdtemp(root));
}

static int remove_one(const char *path, const struct stat *s, int kind, struct FTW *at) {
    (void)s;
    (void)kind;
    (void)at;
    return remove(path);
}

static void close_root(void) {
    ck_assert_int_eq(nftw(root, remove_one, 8, FTW_DEPTH | FTW_PHYS), 0);
}

/* Writes a file under root, with its folders. */
static void put(const char *name, const char *text) {
    char path[512];
    snprintf(path, sizeof path, "%s/%s", root, name);
    for (char *slash = strchr(path + strlen(root) + 1, '/'); slash != NULL; slash = strchr(slash + 1, '/')) {
        *slash = '\0';
        (void)mkdir(path, 0755);
        *slash = '/';
    }
    FILE *stream = fopen(path, "w");
    ck_assert_ptr_nonnull(stream);
    ck_assert_int_ge(fputs(text, stream), 0);
    ck_assert_int_eq(fclose(stream), 0);
}

static machine read_root(void) {
    machine m;
    machine_read(root, &m);
    ck_assert_uint_ge(m.own, 1);
    ck_assert_uint_ge(m.processors, m.own);
    return m;
}

START_TEST(nothing_to_read) {
    const machine m = read_root();
    ck_assert(isinf(m.quota) && m.tasks_left == UINT64_MAX && m.memory_most == UINT64_MAX &&
              m.memory_left == UINT64_MAX);
}
END_TEST

/* The least of a group and its ancestors holds. */
START_TEST(second_version) {
    put("proc/self/cgroup", "0::/pod/box\n");
    put("sys/fs/cgroup/pod/box/cpu.max", "max 100000\n");
    put("sys/fs/cgroup/pod/box/memory.max", "max\n");
    put("sys/fs/cgroup/pod/box/pids.max", "100\n");
    put("sys/fs/cgroup/pod/box/pids.current", "3\n");
    put("sys/fs/cgroup/pod/cpu.max", "150000 100000\n");
    put("sys/fs/cgroup/pod/memory.max", "1000000\n");
    put("sys/fs/cgroup/pod/memory.current", "700000\n");
    put("sys/fs/cgroup/pod/memory.stat", "anon 5\nfile 600000\ninactive_file 200000\n");
    put("sys/fs/cgroup/pod/pids.max", "60\n");
    put("sys/fs/cgroup/pod/pids.current", "20\n");
    const machine m = read_root();
    ck_assert_double_eq(m.quota, 1.5);
    ck_assert_uint_eq(m.memory_most, 1000000);
    ck_assert_uint_eq(m.memory_left, 500000);
    ck_assert_uint_eq(m.tasks_left, 40);
}
END_TEST

/* A container sees its own group at the top, under the path of the host or under /. */
START_TEST(top_of_a_container) {
    static const char *const lines[] = {"0::/\n", "0::/kubepods/pod7/abc\n"};
    put("proc/self/cgroup", lines[_i]);
    put("sys/fs/cgroup/cpu.max", "200000 100000\n");
    put("sys/fs/cgroup/memory.max", "4096000\n");
    const machine m = read_root();
    ck_assert_double_eq(m.quota, 2);
    ck_assert_uint_eq(m.memory_left, 4096000);
}
END_TEST

START_TEST(first_version) {
    put("proc/self/cgroup",
        "12:name=systemd:/a\n5:cpu,cpuacct:/a\n4:memory:/a/b\n3:pids:/a\n0::/\nrubbish\n:\n9:\n");
    put("sys/fs/cgroup/cpu,cpuacct/a/cpu.cfs_quota_us", "250000\n");
    put("sys/fs/cgroup/cpu,cpuacct/a/cpu.cfs_period_us", "100000\n");
    put("sys/fs/cgroup/cpu,cpuacct/cpu.cfs_quota_us", "-1\n");
    put("sys/fs/cgroup/cpu,cpuacct/cpu.cfs_period_us", "100000\n");
    put("sys/fs/cgroup/memory/a/b/memory.limit_in_bytes", "9223372036854771712\n");
    put("sys/fs/cgroup/memory/a/memory.limit_in_bytes", "8000\n");
    put("sys/fs/cgroup/memory/a/memory.usage_in_bytes", "9000\n");
    put("sys/fs/cgroup/pids/a/pids.max", "max\n");
    const machine m = read_root();
    ck_assert_double_eq(m.quota, 2.5);
    ck_assert_uint_eq(m.memory_most, 8000);
    ck_assert_uint_eq(m.memory_left, 0);
    ck_assert_uint_eq(m.tasks_left, UINT64_MAX);
}
END_TEST

/* The reason is that of the limit that holds. */
START_TEST(threads) {
    static const struct {
        machine m;
        size_t threads;
        const char *why;
    } cases[] = {
        {{64, 64, (double)INFINITY, UINT64_MAX, 0, 0}, 64, ""},
        {{64, 2, (double)INFINITY, UINT64_MAX, 0, 0}, 2, "may run on 2 of 64"},
        {{64, 64, 1.5, UINT64_MAX, 0, 0}, 2, "the time of 1.5 processors"},
        {{64, 64, .3, UINT64_MAX, 0, 0}, 1, "the time of 0.3 processors"},
        {{64, 3, 8, UINT64_MAX, 0, 0}, 3, "may run on 3 of 64"},
        {{64, 64, 64, 70, 0, 0}, 64, ""},
        {{64, 64, 64, 30, 0, 0}, 24, "may start 30 more"},
        {{64, 64, 64, 2, 0, 0}, 1, "may start 2 more"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char why[96];
        ck_assert_uint_eq(machine_threads(&cases[k].m, 6, why, sizeof why), cases[k].threads);
        ck_assert_msg(cases[k].why[0] == '\0' ? why[0] == '\0' : strstr(why, cases[k].why) != NULL, "%s",
                      why);
    }
}
END_TEST

int main(void) {
    Suite *suite = suite_create("machine");
    TCase *tests = tcase_create("machine");
    tcase_add_checked_fixture(tests, open_root, close_root);
    tcase_add_test(tests, nothing_to_read);
    tcase_add_test(tests, second_version);
    tcase_add_loop_test(tests, top_of_a_container, 0, 2);
    tcase_add_test(tests, first_version);
    tcase_add_test(tests, threads);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
