/* A store in bad weather: damaged and foreign files, a full disk, no memory, a killed writer. */
#include "support/failing_memory.h"
#include "support/store_sample.h"
#include "support/suite.h"

#include "solver/base/random.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>

static char folder[64], path[256];
static lam_error error;

static void setup(void) {
    sample_folder(folder);
    snprintf(path, sizeof path, "%s/sample.h5", folder);
    memset(&error, 0, sizeof error);
    allocations_left = -1;
}

static void teardown(void) {
    sample_folder_remove(folder);
}

/* A message is one line that names the file. */
static void check_message(const char *context) {
    ck_assert_msg(strstr(error.message, path) != NULL, "%s: no file named in \"%s\"", context, error.message);
    ck_assert_msg(strpbrk(error.message, "\n\r") == NULL, "%s: more than a line", context);
}

START_TEST(every_failed_allocation_is_an_error) {
    uint64_t expected = 0, reading = 0;
    ck_ok(sample_write(path, 1, &error));
    ck_ok(sample_read(path, &expected, &error));
    long failures[2] = {0, 0};
    for (int reads = 0; reads < 2; reads++) {
        for (long k = 0;; k++) {
            ck_assert_int_lt(k, 100000);
            reading = 0;
            allocations_left = k;
            lam_status status = reads ? sample_read(path, &reading, &error) : sample_write(path, 1, &error);
            allocations_left = -1;
            ck_assert_int_eq(sample_folder_extras(folder, "sample.h5"), 0);
            if (status == LAM_OK) break;
            ck_assert_msg(status == LAM_ERR_MEMORY, "allocation %ld: %s", k, error.message);
            ck_assert_uint_eq(reading, 0);
            failures[reads]++;
        }
        ck_ok(sample_read(path, &reading, &error));
        ck_assert_uint_eq(reading, expected);
    }
    ck_assert_int_gt(failures[0], SAMPLE_ARRAYS);
    ck_assert_int_gt(failures[1], SAMPLE_ARRAYS);
}
END_TEST

typedef struct damage_count {
    long found, harmless;
} damage_count;

/* After any damage: an error that names the file, or exactly what was written. */
static void check_damaged(const char *what, size_t place, uint64_t expected, damage_count *count) {
    char context[80];
    uint64_t reading = 0;
    store *s = NULL;
    snprintf(context, sizeof context, "%s at %zu", what, place);
    lam_status status = sample_read(path, &reading, &error);
    if (status == LAM_OK) {
        ck_assert_msg(reading == expected, "%s: other data was read and nobody told", context);
        count->harmless++;
    } else {
        check_message(context);
        count->found++;
    }
    /* Looking at everything finds no less than reading everything. */
    lam_status whole = store_open(path, &s, &error);
    if (whole == LAM_OK) whole = store_verify(s, &error);
    store_close(s);
    ck_assert_msg(status == LAM_OK || whole != LAM_OK, "%s: read as damaged, but verified", context);
}

/* The file once more with `size` bytes at `place` put in; restores the bytes in memory. */
static void check_patched(const char *what, unsigned char *bytes, size_t file_size, size_t place,
                          const unsigned char *patch, size_t size, uint64_t expected, damage_count *count) {
    unsigned char *kept = malloc(size);
    memcpy(kept, bytes + place, size);
    memcpy(bytes + place, patch, size);
    sample_save(path, bytes, file_size);
    check_damaged(what, place, expected, count);
    memcpy(bytes + place, kept, size);
    free(kept);
}

/* One flipped bit or byte at some hundred places, those of the file's head first. */
START_TEST(flipped_bytes_are_found) {
    uint64_t expected = 0, random = 12345;
    size_t size;
    damage_count count = {0, 0};
    ck_ok(sample_write(path, 1, &error));
    ck_ok(sample_read(path, &expected, &error));
    unsigned char *bytes = sample_load(path, &size);
    for (size_t i = 0; i < 700; i++) {
        random_lcg(&random);
        size_t place = i < 200 ? i : (size_t)(random >> 33) % size;
        unsigned char mask = i % 3 == 0 ? (unsigned char)(random >> 25) | 1 : (unsigned char)(1 << (i % 8));
        unsigned char flipped = bytes[place] ^ mask;
        check_patched("flip", bytes, size, place, &flipped, 1, expected, &count);
    }
    ck_assert_int_gt(count.found, 100);
    free(bytes);
}
END_TEST

/* Whole stretches: zeros where a disk lost a block, noise, and the file's own bytes in another place. */
START_TEST(overwritten_stretches_are_found) {
    uint64_t expected = 0, random = 54321;
    size_t size;
    damage_count count = {0, 0};
    ck_ok(sample_write(path, 1, &error));
    ck_ok(sample_read(path, &expected, &error));
    unsigned char *bytes = sample_load(path, &size);
    for (size_t i = 0; i < 300; i++) {
        random_lcg(&random);
        size_t length = (size_t)1 << (i % 10), place = (size_t)(random >> 33) % (size - length);
        size_t source = (size_t)(random >> 13) % (size - length);
        unsigned char *patch = i % 3 == 0 ? calloc(length, 1) : sample_values(length, random);
        if (i % 3 == 1) memcpy(patch, bytes + source, length);
        check_patched("stretch", bytes, size, place, patch, length, expected, &count);
        free(patch);
    }
    ck_assert_int_gt(count.found, 50);
    free(bytes);
}
END_TEST

START_TEST(truncated_files_are_refused) {
    store *s = NULL;
    size_t size, tried = 0;
    ck_ok(sample_write(path, 1, &error));
    unsigned char *bytes = sample_load(path, &size);
    for (size_t length = 0; length < size; length += length < 64 || size - length < 64 ? 1 : 37, tried++) {
        sample_save(path, bytes, length);
        lam_status status = store_open(path, &s, &error);
        ck_assert_msg(status == LAM_ERR_FORMAT, "%zu of %zu bytes: %s", length, size, error.message);
        check_message("truncated");
        ck_assert_ptr_null(s);
    }
    ck_assert_uint_gt(tried, 200);
    free(bytes);
}
END_TEST

/* It becomes short or another while it is open. */
START_TEST(a_file_that_changes_under_the_reader) {
    store *s = NULL;
    uint64_t reading = 0;
    size_t size;
    ck_ok(sample_write(path, 1, &error));
    unsigned char *bytes = sample_load(path, &size);
    ck_ok(store_open(path, &s, &error));
    ck_assert_int_eq(truncate(path, 100), 0);
    ck_assert_int_ne(sample_read_open(s, &reading, &error), LAM_OK);
    check_message("shortened");
    store_close(s);
    sample_save(path, bytes, size);
    ck_ok(store_open(path, &s, &error));
    for (size_t i = 0; i < size; i++) bytes[i] ^= 0x55;
    sample_save(path, bytes, size);
    ck_assert_int_ne(sample_read_open(s, &reading, &error), LAM_OK);
    check_message("changed");
    store_close(s);
    free(bytes);
}
END_TEST

/* A sample as tests/support/foreign_stores.py changes it, and the status that reading all of it must answer.
 */
static const struct foreign {
    const char *name;
    lam_status expected;
    lam_status by_library; /* where a newer HDF5 refuses it before our checks do; 0: it does not */
} foreigners[] = {
    {"sound", LAM_OK, LAM_OK},
    {"plain_hdf5", LAM_ERR_FORMAT, LAM_OK},
    {"plain_hdf5_new", LAM_ERR_FORMAT, LAM_OK},
    {"format_other", LAM_ERR_FORMAT, LAM_OK},
    {"format_number", LAM_ERR_FORMAT, LAM_OK},
    {"format_variable", LAM_ERR_FORMAT, LAM_OK},
    {"version_newer", LAM_ERR_VERSION, LAM_OK},
    {"version_zero", LAM_ERR_VERSION, LAM_OK},
    {"version_text", LAM_ERR_FORMAT, LAM_OK},
    {"version_absent", LAM_ERR_FORMAT, LAM_OK},
    {"checksum_absent", LAM_ERR_FORMAT, LAM_OK},
    {"checksum_array", LAM_ERR_FORMAT, LAM_OK},
    {"checksum_unsummed", LAM_ERR_FORMAT, LAM_OK},
    {"checksum_other", LAM_ERR_DAMAGED, LAM_OK},
    {"checksum_forged", LAM_ERR_DAMAGED, LAM_OK},
    {"checksum_f64", LAM_ERR_FORMAT, LAM_OK},
    {"checksum_one_gone", LAM_ERR_DAMAGED, LAM_OK},
    {"array_changed", LAM_ERR_DAMAGED, LAM_OK},
    {"array_gone", LAM_ERR_FORMAT, LAM_OK},
    {"array_added", LAM_ERR_DAMAGED, LAM_OK},
    {"array_chunked", LAM_ERR_FORMAT, LAM_OK},
    {"array_compressed", LAM_ERR_FORMAT, LAM_OK},
    {"array_external", LAM_ERR_FORMAT, LAM_OK},
    {"array_virtual", LAM_ERR_FORMAT, LAM_OK},
    {"array_unallocated", LAM_ERR_FORMAT, LAM_OK},
    {"array_huge", LAM_ERR_FORMAT, LAM_OK},
    {"array_big_endian", LAM_ERR_FORMAT, LAM_OK},
    {"array_compound", LAM_ERR_FORMAT, LAM_OK},
    {"array_rank_5", LAM_ERR_FORMAT, LAM_OK},
    {"array_scalar", LAM_ERR_FORMAT, LAM_OK},
    {"array_empty", LAM_ERR_FORMAT, LAM_OK},
    {"array_is_group", LAM_ERR_FORMAT, LAM_OK},
    {"forged_size", LAM_ERR_FORMAT, LAM_ERR_DAMAGED},
    {"forged_wrap", LAM_ERR_FORMAT, LAM_ERR_DAMAGED},
    {"forged_storage", LAM_ERR_FORMAT, LAM_OK},
    {"forged_place", LAM_ERR_FORMAT, LAM_ERR_DAMAGED},
    {"headers_unsummed", LAM_ERR_FORMAT, LAM_OK},
    {"texts_variable", LAM_ERR_FORMAT, LAM_OK},
    {"link_soft", LAM_ERR_FORMAT, LAM_OK},
    {"link_dangling", LAM_ERR_FORMAT, LAM_OK},
    {"link_external", LAM_ERR_FORMAT, LAM_OK},
    {"link_cycle", LAM_ERR_FORMAT, LAM_OK},
    {"groups_deep", LAM_ERR_FORMAT, LAM_OK},
    {"name_long", LAM_ERR_FORMAT, LAM_OK},
    {"type_committed", LAM_ERR_FORMAT, LAM_OK},
};
enum { FOREIGNERS = sizeof foreigners / sizeof *foreigners };

START_TEST(foreign_files_are_refused) {
    char command[512];
    uint64_t expected = 0;
    ck_ok(sample_write(path, 1, &error));
    ck_ok(sample_read(path, &expected, &error));
    snprintf(command, sizeof command, "/usr/bin/python3 '%s/../support/foreign_stores.py' '%s'", FIXTURES,
             path);
    FILE *made = popen(command, "r");
    ck_assert_ptr_nonnull(made);
    char name[128];
    int seen = 0;
    while (fgets(name, sizeof name, made) != NULL) {
        name[strcspn(name, "\n")] = '\0';
        int i = 0;
        while (i < FOREIGNERS && strcmp(foreigners[i].name, name) != 0) i++;
        ck_assert_msg(i < FOREIGNERS, "nothing is expected of %s", name);
        snprintf(path, sizeof path, "%s/%s.h5", folder, name);
        uint64_t reading = 0;
        lam_status status = sample_read(path, &reading, &error);
        const lam_status other = foreigners[i].by_library;
        ck_assert_msg(status == foreigners[i].expected || (other != LAM_OK && status == other), "%s: %s: %s",
                      name, lam_status_text(status), error.message);
        if (status == LAM_OK)
            ck_assert_uint_eq(reading, expected);
        else
            check_message(name);
        if (status == LAM_ERR_VERSION) /* which was found and which is read */
            ck_assert_ptr_nonnull(strstr(error.message, "reads version 1; "));
        seen++;
    }
    ck_assert_int_eq(pclose(made), 0);
    ck_assert_int_eq(seen, FOREIGNERS);
}
END_TEST

/* A limit on the size of files stands for a disk that is full at that byte: the write that passes it fails.
 * From the first byte to the last: an error that says so, the older file whole, nothing beside it. */
START_TEST(a_full_disk_leaves_the_older_file) {
    uint64_t older = 0, reading = 0;
    size_t size, failures = 0;
    struct rlimit limit;
    signal(SIGXFSZ, SIG_IGN);
    ck_ok(sample_write(path, 1, &error));
    ck_ok(sample_read(path, &older, &error));
    free(sample_load(path, &size));
    ck_assert_int_eq(getrlimit(RLIMIT_FSIZE, &limit), 0);
    const rlim_t unlimited = limit.rlim_cur;
    for (size_t room = 0; room < size; room += room == 0 ? 1 : 61) {
        limit.rlim_cur = room;
        ck_assert_int_eq(setrlimit(RLIMIT_FSIZE, &limit), 0);
        lam_status status = sample_write(path, 2, &error);
        limit.rlim_cur = unlimited;
        ck_assert_int_eq(setrlimit(RLIMIT_FSIZE, &limit), 0);
        ck_assert_msg(status == LAM_ERR_IO, "room for %zu of %zu bytes: %s", room, size, error.message);
        check_message("full disk");
        ck_assert_msg(strstr(error.message, strerror(EFBIG)) != NULL, "%s", error.message);
        ck_assert_int_eq(sample_folder_extras(folder, "sample.h5"), 0);
        failures++;
    }
    ck_ok(sample_read(path, &reading, &error));
    ck_assert_uint_eq(reading, older);
    ck_assert_uint_gt(failures, 100);
    ck_ok(sample_write(path, 2, &error)); /* and once there is room, all is well */
    ck_ok(sample_read(path, &reading, &error));
    ck_assert_uint_ne(reading, older);
}
END_TEST

/* The first write to fail is that of a large array. */
START_TEST(a_full_disk_in_a_large_array) {
    store *s = NULL;
    struct rlimit limit;
    const size_t count = 1 << 20;
    float *values = calloc(count, sizeof *values);
    signal(SIGXFSZ, SIG_IGN);
    ck_ok(store_create(path, &s, &error));
    ck_assert_int_eq(getrlimit(RLIMIT_FSIZE, &limit), 0);
    const rlim_t unlimited = limit.rlim_cur;
    limit.rlim_cur = 1 << 20;
    ck_assert_int_eq(setrlimit(RLIMIT_FSIZE, &limit), 0);
    ck_assert_int_eq(store_write(s, "/operator/Y", STORE_F32, 1, &count, values, &error), LAM_ERR_IO);
    limit.rlim_cur = unlimited;
    ck_assert_int_eq(setrlimit(RLIMIT_FSIZE, &limit), 0);
    check_message("large array");
    ck_assert_ptr_nonnull(strstr(error.message, "/operator/Y"));
    /* There is room again, but something is missing. */
    ck_assert_int_eq(store_seal(s, &error), LAM_ERR_IO);
    check_message("seal");
    ck_assert_int_eq(sample_folder_extras(folder, NULL), 0);
    free(values);
}
END_TEST

/* Killed after some arrays, while writing more: the target is as it was, and the next one can be made. */
START_TEST(a_killed_writer_leaves_the_target) {
    uint64_t older = 0, reading = 0;
    ck_ok(sample_write(path, 1, &error));
    ck_ok(sample_read(path, &older, &error));
    for (int round = 0; round < 12; round++) {
        int tell[2];
        char sign;
        ck_assert_int_eq(pipe(tell), 0);
        pid_t writer = fork();
        ck_assert_int_ge(writer, 0);
        if (writer == 0) {
            store *s = NULL;
            char name[32];
            double *values = calloc(20000, sizeof *values);
            if (store_create(path, &s, &error) != LAM_OK) _exit(1);
            for (int i = 0;; i++) {
                snprintf(name, sizeof name, "/mesh/array_%d", i);
                const size_t count = 20000;
                if (store_write(s, name, STORE_F64, 1, &count, values, &error) != LAM_OK) _exit(1);
                if (write(tell[1], "x", 1) != 1) _exit(1);
            }
        }
        close(tell[1]);
        for (int i = 0; i <= round; i++) ck_assert_int_eq(read(tell[0], &sign, 1), 1);
        ck_assert_int_eq(kill(writer, SIGKILL), 0);
        int how;
        ck_assert_int_eq(waitpid(writer, &how, 0), writer);
        ck_assert(WIFSIGNALED(how));
        close(tell[0]);
        ck_ok(sample_read(path, &reading, &error));
        ck_assert_uint_eq(reading, older);
    }
    ck_ok(sample_write(path, 2, &error));
    ck_ok(sample_read(path, &reading, &error));
    ck_assert_uint_ne(reading, older);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("store_weather");
    TCase *tests = tcase_create("store_weather");
    tcase_set_timeout(tests, 300);
    tcase_add_checked_fixture(tests, setup, teardown);
    tcase_add_test(tests, every_failed_allocation_is_an_error);
    tcase_add_test(tests, flipped_bytes_are_found);
    tcase_add_test(tests, overwritten_stretches_are_found);
    tcase_add_test(tests, truncated_files_are_refused);
    tcase_add_test(tests, a_file_that_changes_under_the_reader);
    tcase_add_test(tests, foreign_files_are_refused);
    tcase_add_test(tests, a_full_disk_leaves_the_older_file);
    tcase_add_test(tests, a_full_disk_in_a_large_array);
    tcase_add_test(tests, a_killed_writer_leaves_the_target);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
