/* Data written to a store comes back; a file that is not a store is refused. */
#include "store/store_private.h"
#include "support/store_sample.h"
#include "support/suite.h"

#include <fcntl.h>
#include <math.h>
#include <sys/stat.h>
#include <time.h>

static char folder[64], path[128];
static lam_error error;

static void setup(void) {
    sample_folder(folder);
    snprintf(path, sizeof path, "%s/sample.h5", folder);
    memset(&error, 0, sizeof error);
}

static void teardown(void) {
    sample_folder_remove(folder);
}

/* Fails with this status, and a message of one line that has these words in it. */
static void check_failure(lam_status status, lam_status expected, const char *words) {
    ck_assert_msg(status == expected, "%s instead of %s: %s", lam_status_text(status),
                  lam_status_text(expected), error.message);
    ck_assert_int_eq(error.status, expected);
    ck_assert_msg(strstr(error.message, words) != NULL, "\"%s\" is not in: %s", words, error.message);
}

START_TEST(arrays_come_back) {
    store *s = NULL;
    ck_ok(sample_write(path, 1, &error));
    ck_ok(store_open(path, &s, &error));
    ck_assert_str_eq(store_path(s), path);
    ck_assert_ptr_null(s->partial);
    ck_ok(store_verify(s, &error));
    for (int i = 0; i < SAMPLE_ARRAYS; i++) {
        const sample_array *array = &sample_arrays[i];
        size_t dims[STORE_MAX_RANK], bytes = sample_bytes(array);
        store_type type;
        int rank = 0;
        void *values = NULL;
        unsigned char *expected = sample_values(bytes, 1 + (uint64_t)i);
        ck_assert(store_has(s, array->name));
        ck_ok(store_array_info(s, array->name, &type, &rank, dims, &error));
        ck_assert_int_eq(type, array->type);
        ck_assert_int_eq(rank, array->rank);
        ck_assert_mem_eq(dims, array->dims, (size_t)rank * sizeof *dims);
        dims[0] = SIZE_MAX;
        ck_ok(store_read(s, array->name, type, rank, dims, &values, &error));
        ck_assert_uint_eq(dims[0], array->dims[0]);
        ck_assert_mem_eq(values, expected, bytes);
        free(values);
        free(expected);
    }
    store_close(s);
}
END_TEST

/* Values of each type keep their meaning, the extremes included. */
START_TEST(values_keep_their_type) {
    store *s = NULL;
    const float f32[] = {1.5f, -0.0f, INFINITY, 1e-45f};
    const double f64[] = {0.1, -INFINITY, 5e-324, 1.7976931348623157e308};
    const uint32_t u32[] = {0, 1, 0x12345678u, UINT32_MAX};
    const uint64_t u64[] = {0, 1, 0x123456789abcdef0u, UINT64_MAX};
    const uint16_t f16[] = {0x3e00, 0x8000, 0x7c00, 0x0001}, u16[] = {0, 1, 0x1234, UINT16_MAX};
    const int8_t i8[] = {0, -1, INT8_MIN, INT8_MAX};
    const void *all[] = {f32, f64, u32, u64, f16, u16, i8};
    const store_type types[] = {STORE_F32, STORE_F64, STORE_U32, STORE_U64, STORE_F16, STORE_U16, STORE_I8};
    const char *names[] = {"/f32", "/f64", "/u32", "/u64", "/f16", "/u16", "/i8"};
    enum { TYPES = sizeof types / sizeof *types };
    const size_t four = 4;
    ck_ok(store_create(path, &s, &error));
    for (int i = 0; i < TYPES; i++) ck_ok(store_write(s, names[i], types[i], 1, &four, all[i], &error));
    ck_ok(store_seal(s, &error));
    ck_ok(store_open(path, &s, &error));
    for (int i = 0; i < TYPES; i++) {
        size_t dims = 4;
        void *values = NULL;
        ck_ok(store_read(s, names[i], types[i], 1, &dims, &values, &error));
        ck_assert_mem_eq(values, all[i], 4 * store_type_size(types[i]));
        free(values);
        values = NULL;
        ck_assert(store_read(s, names[i], types[(i + 1) % TYPES], 1, &dims, &values, &error) ==
                  LAM_ERR_FORMAT);
    }
    store_close(s);
}
END_TEST

/* Several pieces, the last one short; and a whole number of pieces. */
START_TEST(large_arrays_come_back) {
    const size_t sizes[] = {(size_t)3 << 20, ((size_t)2 << 20) + 4, 1 << 20};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        store *s = NULL;
        void *values = NULL;
        size_t dims = sizes[i] / 4;
        unsigned char *expected = sample_values(sizes[i], 5);
        ck_ok(store_create(path, &s, &error));
        ck_ok(store_write(s, "/operator/Y", STORE_F32, 1, &dims, expected, &error));
        ck_ok(store_seal(s, &error));
        ck_ok(store_open(path, &s, &error));
        ck_ok(store_verify(s, &error));
        ck_ok(store_read(s, "/operator/Y", STORE_F32, 1, &dims, &values, &error));
        ck_assert_mem_eq(values, expected, sizes[i]);
        store_close(s);
        free(values);

        /* A flipped bit in the last value is found and its place named. */
        size_t size;
        unsigned char *bytes = sample_load(path, &size);
        unsigned char *tail = memmem(bytes, size, expected + sizes[i] - 64, 64);
        ck_assert_ptr_nonnull(tail);
        tail[63] ^= 1;
        sample_save(path, bytes, size);
        ck_ok(store_open(path, &s, &error));
        values = bytes;
        check_failure(store_read(s, "/operator/Y", STORE_F32, 1, &dims, &values, &error), LAM_ERR_DAMAGED,
                      "/operator/Y");
        ck_assert_ptr_eq(values, bytes);
        char where[64];
        size_t pieces = (sizes[i] + (1 << 20) - 1) >> 20;
        snprintf(where, sizeof where, "MiB %zu of %zu", pieces, pieces);
        check_failure(store_verify(s, &error), LAM_ERR_DAMAGED, where);
        store_close(s);
        free(bytes);
        free(expected);
    }
}
END_TEST

START_TEST(texts_come_back) {
    store *s = NULL;
    char **texts = NULL;
    size_t count = 99;
    ck_ok(sample_write(path, 1, &error));
    ck_ok(store_open(path, &s, &error));
    ck_ok(store_read_texts(s, "/mesh/group_names", &count, &texts, &error));
    ck_assert_uint_eq(count, SAMPLE_TEXTS);
    for (size_t i = 0; i < count; i++) ck_assert_str_eq(texts[i], sample_texts[i]);
    free(texts);
    ck_ok(store_read_texts(s, "/operator/names", &count, &texts, &error));
    ck_assert_uint_eq(count, 0);
    free(texts);
    store_close(s);
}
END_TEST

typedef struct seen {
    int count;
    char last[64];
    double sum;
} seen;

static void see(void *context, const char *name, const char *text, double number) {
    seen *all = context;
    ck_assert_int_lt(strcmp(all->last, name), 0);
    snprintf(all->last, sizeof all->last, "%s", name);
    all->count++;
    all->sum += text == NULL ? number : 0;
}

START_TEST(attributes_come_back) {
    store *s = NULL;
    char *text = NULL, *large = malloc(100001);
    double number = 0;
    int64_t integer = 0;
    memset(large, 'c', 100000);
    large[100000] = '\0';
    ck_ok(store_create(path, &s, &error));
    ck_ok(sample_fill(s, 1, &error));
    ck_ok(store_set_text(s, "/", "command", large, &error)); /* more than a header of HDF5 holds */
    ck_ok(store_set_text(s, "/new/deep/group", "name", "Küche", &error));
    ck_ok(store_set_number(s, "/new", "value", 1, &error));
    ck_ok(store_set_text(s, "/new", "value", "first", &error)); /* replaces, whatever the type */
    ck_ok(store_set_text(s, "/new", "value", "second, longer", &error));
    ck_ok(store_seal(s, &error));
    ck_ok(store_open(path, &s, &error));
    ck_ok(store_get_text(s, "/", "command", &text, &error));
    ck_assert_str_eq(text, large);
    free(text);
    ck_ok(store_get_text(s, "/new/deep/group", "name", &text, &error));
    ck_assert_str_eq(text, "Küche");
    free(text);
    ck_ok(store_get_text(s, "/new", "value", &text, &error));
    ck_assert_str_eq(text, "second, longer");
    free(text);
    ck_ok(store_get_text(s, "/mesh", "unit", &text, &error));
    ck_assert_str_eq(text, "");
    free(text);
    ck_ok(store_get_number(s, "/mesh/area", "total", &number, &error));
    ck_assert_double_eq(number, 0.1);
    ck_ok(store_get_integer(s, "/", "seed", &integer, &error));
    ck_assert_int_eq(integer, INT64_MAX);
    ck_ok(store_get_number(s, "/", "version", &number, &error));
    ck_assert_double_eq(number, STORE_VERSION);
    ck_assert(store_has_attribute(s, "/", "seed") && !store_has_attribute(s, "/", "sead"));
    ck_assert(!store_has_attribute(s, "/nowhere", "seed"));

    seen all = {0};
    double sum = 0;
    for (int i = 0; i < SAMPLE_NUMBERS; i++) sum += 1.0 / (i + 1); /* in the order of the names */
    ck_ok(store_each_attribute(s, "/error/single", see, &all, &error));
    ck_assert_int_eq(all.count, SAMPLE_NUMBERS);
    ck_assert_double_eq(all.sum, sum);
    all = (seen){0};
    ck_ok(store_each_attribute(s, "/error", see, &all, &error));
    ck_assert_int_eq(all.count, 0);
    store_close(s);
    free(large);
}
END_TEST

START_TEST(created_is_a_date) {
    store *s = NULL;
    char *created = NULL;
    int year, month, day, hour, minute, second, end = 0;
    ck_ok(sample_write(path, 1, &error));
    ck_ok(store_open(path, &s, &error));
    ck_ok(store_get_text(s, "/", "created", &created, &error));
    sscanf(created, "%4d-%2d-%2dT%2d:%2d:%2dZ%n", &year, &month, &day, &hour, &minute, &second, &end);
    ck_assert_int_eq(end, 20);
    ck_assert_uint_eq(strlen(created), 20);
    free(created);
    store_close(s);
}
END_TEST

START_TEST(wrong_requests_are_refused) {
    store *s = NULL;
    size_t one = SIZE_MAX, two[2] = {SIZE_MAX, 5}, dims[4], count = 42;
    int marker, rank;
    store_type type;
    void *values = &marker;
    char **texts = NULL, *text = NULL;
    double number = 42;
    int64_t integer = 42;
    uint64_t bytes = 42;
    ck_ok(sample_write(path, 1, &error));
    ck_ok(store_open(path, &s, &error));
    check_failure(store_read(s, "/mesh/nothing", STORE_F64, 1, &one, &values, &error), LAM_ERR_FORMAT,
                  "/mesh/nothing");
    check_failure(store_read(s, "/mesh/area/x", STORE_F64, 1, &one, &values, &error), LAM_ERR_FORMAT, path);
    check_failure(store_read(s, "/mesh/area", STORE_F32, 1, &one, &values, &error), LAM_ERR_FORMAT,
                  "f64, must be f32");
    check_failure(store_read(s, "/mesh/area", STORE_F64, 2, two, &values, &error), LAM_ERR_FORMAT,
                  "1 dimensions, must have 2");
    check_failure(store_read(s, "/mesh/normal", STORE_F32, 2, two, &values, &error), LAM_ERR_FORMAT,
                  "dimension 1 of /mesh/normal is 3, must be 5");
    check_failure(store_read(s, "/mesh/group_names", STORE_F32, 1, &one, &values, &error), LAM_ERR_FORMAT,
                  "texts");
    check_failure(store_array_info(s, "/mesh", &type, &rank, dims, &error), LAM_ERR_FORMAT, "/mesh");
    check_failure(store_read_texts(s, "/mesh/area", &count, &texts, &error), LAM_ERR_FORMAT, "/mesh/area");
    check_failure(store_get_text(s, "/", "seed", &text, &error), LAM_ERR_FORMAT, "seed");
    check_failure(store_get_text(s, "/", "sead", &text, &error), LAM_ERR_FORMAT, "sead");
    check_failure(store_get_number(s, "/", "name", &number, &error), LAM_ERR_FORMAT, "name");
    check_failure(store_get_integer(s, "/mesh/area", "total", &integer, &error), LAM_ERR_FORMAT, "total");
    check_failure(store_get_integer(s, "/nothing", "total", &integer, &error), LAM_ERR_FORMAT, "/nothing");
    check_failure(store_each_attribute(s, "/nothing", see, NULL, &error), LAM_ERR_FORMAT, "/nothing");
    check_failure(store_group_bytes(s, "/nothing", &bytes, &error), LAM_ERR_FORMAT, "/nothing");
    ck_assert(!store_has(s, "/mesh/") && !store_has(s, "mesh") && !store_has(s, ""));
    ck_assert(store_has(s, "/") && store_has(s, "/mesh") && store_has(s, "/error/single"));
    /* Outputs are untouched on an error. */
    ck_assert_ptr_eq(values, &marker);
    ck_assert_uint_eq(one, SIZE_MAX);
    ck_assert_uint_eq(two[0], SIZE_MAX);
    ck_assert_uint_eq(count, 42);
    ck_assert(texts == NULL && text == NULL && number == 42 && integer == 42 && bytes == 42);
    store_close(s);
}
END_TEST

START_TEST(bad_names_are_not_written) {
    const char *names[] = {"", "x", "/", "/a//b", "/a/", "/./a", "/checksum/a", "/a/b/c/d/e/f/g/h/i/j"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        store *s = NULL;
        const size_t one = 1;
        ck_ok(store_create(path, &s, &error));
        check_failure(store_write(s, names[i], STORE_F64, 1, &one, &(double){1}, &error), LAM_ERR_ARGUMENT,
                      path);
        ck_assert_int_ne(store_seal(s, &error), LAM_OK); /* an incomplete store is not sealed */
        ck_assert_int_eq(sample_folder_extras(folder, NULL), 0);
    }
    store *s = NULL;
    const size_t dims[] = {SIZE_MAX / 2, 2};
    ck_ok(store_create(path, &s, &error));
    check_failure(store_write(s, "/a", STORE_F32, 2, dims, &(float){1}, &error), LAM_ERR_ARGUMENT, "/a");
    store_close(s);
}
END_TEST

START_TEST(an_array_is_written_once) {
    store *s = NULL;
    const size_t one = 1;
    ck_ok(store_create(path, &s, &error));
    ck_ok(store_write(s, "/a", STORE_F64, 1, &one, &(double){1}, &error));
    ck_assert_int_ne(store_write(s, "/a", STORE_F64, 1, &one, &(double){2}, &error), LAM_OK);
    ck_assert_int_ne(store_seal(s, &error), LAM_OK);
    ck_assert_int_eq(sample_folder_extras(folder, NULL), 0);
}
END_TEST

START_TEST(group_bytes_are_counted) {
    store *s = NULL;
    uint64_t mesh = 0, form_factors = 0, error_bytes = 1;
    ck_ok(sample_write(path, 1, &error));
    ck_ok(store_open(path, &s, &error));
    ck_ok(store_group_bytes(s, "/mesh", &mesh, &error));
    ck_ok(store_group_bytes(s, "/form_factors", &form_factors, &error));
    ck_ok(store_group_bytes(s, "/error", &error_bytes, &error));
    /* group_names: 5 texts as long as the longest, "ceiling ☼", 11 bytes */
    ck_assert_uint_eq(mesh, 19 * 3 * 8 + 23 * 4 * 4 + 23 * 8 + 23 * 3 * 4 + 5 * 11);
    ck_assert_uint_eq(form_factors, 24 * 8);
    ck_assert_uint_eq(error_bytes, 0);
    store_close(s);
}
END_TEST

/* Two stores from equal input, made in different seconds, differ in the date (20 characters) and in the
 * checksum of the header that holds it (4 bytes), nowhere else. */
START_TEST(equal_input_gives_equal_bytes) {
    char second[160];
    size_t sizes[2], different = 0;
    snprintf(second, sizeof second, "%s/second.h5", folder);
    ck_ok(sample_write(path, 1, &error));
    nanosleep(&(struct timespec){.tv_sec = 1, .tv_nsec = 100000000}, NULL);
    ck_ok(sample_write(second, 1, &error));
    unsigned char *a = sample_load(path, &sizes[0]), *b = sample_load(second, &sizes[1]);
    ck_assert_uint_eq(sizes[0], sizes[1]);
    for (size_t i = 0; i < sizes[0]; i++) different += a[i] != b[i];
    ck_assert_uint_ge(different, 2);
    ck_assert_uint_le(different, 20 + 4);
    free(a);
    free(b);
}
END_TEST

static bool skip_nothing(const char *object, const char *attribute) {
    (void)object;
    (void)attribute;
    return false;
}

static bool skip_some(const char *object, const char *attribute) {
    return attribute == NULL ? strcmp(object, "/left") == 0 : strcmp(attribute, "command") == 0;
}

START_TEST(a_copy_has_all_but_what_is_skipped) {
    store *from = NULL, *to = NULL;
    char copy[160], *text = NULL;
    int64_t integer = 0;
    double number = 0;
    const float x[3] = {1, 2, 3};
    snprintf(copy, sizeof copy, "%s/copy.h5", folder);
    ck_ok(store_create(path, &to, &error));
    ck_ok(store_write(to, "/left/x", STORE_F32, 1, (size_t[]){3}, x, &error));
    ck_ok(store_write(to, "/leftover/x", STORE_F32, 1, (size_t[]){3}, x, &error));
    ck_ok(store_write_texts(to, "/kept/names", 2, (const char *const[]){"a", "longer"}, &error));
    ck_ok(store_set_text(to, "/", "command", "old", &error));
    ck_ok(store_set_number(to, "/kept", "number", 1.5, &error));
    ck_ok(store_set_integer(to, "/kept", "integer", INT64_MAX, &error));
    ck_ok(store_set_text(to, "/left", "text", "gone", &error));
    ck_ok(store_seal(to, &error));
    ck_ok(store_open(path, &from, &error));
    ck_ok(store_create(copy, &to, &error));
    ck_ok(store_copy(from, skip_nothing, to, &error));
    ck_ok(store_seal(to, &error));
    ck_ok(store_open(copy, &to, &error));
    ck_assert_str_eq(store_identity_of(to)->digest, store_identity_of(from)->digest);
    ck_assert(store_has_attribute(to, "/left", "text"));
    store_close(to);
    ck_ok(store_create(copy, &to, &error));
    ck_ok(store_copy(from, skip_some, to, &error));
    ck_ok(store_set_text(to, "/", "command", "new", &error));
    ck_ok(store_seal(to, &error));
    ck_ok(store_open(copy, &to, &error));
    ck_assert(!store_has(to, "/left"));
    ck_assert(store_has(to, "/leftover/x"));
    ck_assert(store_has(to, "/kept/names"));
    ck_ok(store_get_text(to, "/", "command", &text, &error));
    ck_assert_str_eq(text, "new");
    ck_ok(store_get_number(to, "/kept", "number", &number, &error));
    ck_ok(store_get_integer(to, "/kept", "integer", &integer, &error));
    ck_assert_double_eq(number, 1.5);
    ck_assert_int_eq(integer, INT64_MAX);
    free(text);
    store_close(to);
    store_close(from);
}
END_TEST

START_TEST(nothing_is_left_without_a_seal) {
    store *s = NULL;
    ck_ok(store_create(path, &s, &error));
    ck_ok(sample_fill(s, 1, &error));
    ck_assert_str_eq(store_path(s), path);
    ck_assert_int_eq(access(s->partial, F_OK), 0);
    ck_assert_int_ne(access(path, F_OK), 0);
    store_close(s);
    ck_assert_int_eq(sample_folder_extras(folder, NULL), 0);
    store_close(NULL);
}
END_TEST

START_TEST(a_seal_replaces_the_older_file_whole) {
    uint64_t first = 0, second = 0, between = 0;
    store *s = NULL;
    ck_ok(sample_write(path, 1, &error));
    ck_ok(sample_read(path, &first, &error));
    ck_ok(store_create(path, &s, &error));
    ck_ok(sample_fill(s, 2, &error));
    ck_ok(sample_read(path, &between, &error));
    ck_assert_uint_eq(first, between);
    ck_ok(store_seal(s, &error));
    ck_ok(sample_read(path, &second, &error));
    ck_assert_uint_ne(first, second);
    ck_assert_int_eq(sample_folder_extras(folder, "sample.h5"), 0);
}
END_TEST

/* A store of one path may be open, also twice, while the next one is made. */
START_TEST(stores_do_not_lock_each_other) {
    store *a = NULL, *b = NULL;
    uint64_t before = 0, after = 0;
    ck_ok(sample_write(path, 1, &error));
    ck_ok(store_open(path, &a, &error));
    ck_ok(sample_read_open(a, &before, &error));
    ck_ok(sample_write(path, 2, &error));
    ck_ok(store_open(path, &b, &error));
    ck_ok(sample_read_open(a, &after, &error));
    ck_assert_uint_eq(before, after);
    ck_ok(sample_read_open(b, &after, &error));
    ck_assert_uint_ne(before, after);
    store_close(a);
    ck_ok(store_verify(b, &error));
    store_close(b);
}
END_TEST

START_TEST(mode_and_link_are_those_of_any_file) {
    char target[160];
    struct stat info;
    snprintf(target, sizeof target, "%s/real.h5", folder);
    mode_t mask = umask(027);
    ck_ok(sample_write(target, 1, &error));
    umask(mask);
    ck_assert_int_eq(stat(target, &info), 0);
    ck_assert_uint_eq(info.st_mode & 0777, 0640);
    ck_assert_int_eq(symlink("real.h5", path), 0);
    ck_ok(sample_write(path, 2, &error));
    ck_assert_int_eq(lstat(path, &info), 0);
    ck_assert(S_ISLNK(info.st_mode));
}
END_TEST

START_TEST(targets_that_cannot_be) {
    store *s = NULL;
    char nowhere[160];
    snprintf(nowhere, sizeof nowhere, "%s/nowhere/sample.h5", folder);
    check_failure(store_create(nowhere, &s, &error), LAM_ERR_IO, nowhere);
    check_failure(store_create(folder, &s, &error), LAM_ERR_IO, "not a regular file");
    check_failure(store_create("/dev/null", &s, &error), LAM_ERR_IO, "/dev/null");
    check_failure(store_create("", &s, &error), LAM_ERR_IO, "names no file");
    ck_assert_ptr_null(s);
    /* It became a folder meanwhile: the rename fails, and nothing is left. */
    ck_ok(store_create(path, &s, &error));
    ck_ok(sample_fill(s, 1, &error));
    ck_assert_int_eq(mkdir(path, 0777), 0);
    check_failure(store_seal(s, &error), LAM_ERR_IO, path);
    ck_assert_int_eq(sample_folder_extras(folder, "sample.h5"), 0);
    ck_assert_int_eq(rmdir(path), 0);
}
END_TEST

START_TEST(what_is_no_store_is_refused) {
    store *s = NULL;
    size_t size;
    check_failure(store_open(path, &s, &error), LAM_ERR_IO, path);
    check_failure(store_open(folder, &s, &error), LAM_ERR_FORMAT, folder);
    check_failure(store_open("/dev/null", &s, &error), LAM_ERR_FORMAT, "/dev/null");
    sample_save(path, "", 0);
    check_failure(store_open(path, &s, &error), LAM_ERR_FORMAT, path);
    sample_save(path, "o Floor\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nthis is a text, not a store\n", 68);
    check_failure(store_open(path, &s, &error), LAM_ERR_FORMAT, path);
    ck_ok(sample_write(path, 1, &error));
    unsigned char *bytes = sample_load(path, &size);
    sample_save(path, bytes, size - 1);
    check_failure(store_open(path, &s, &error), LAM_ERR_FORMAT, "truncated");
    free(bytes);
    unlink(path);
    ck_assert_int_eq(mkfifo(path, 0666), 0); /* must not wait for a writer */
    check_failure(store_open(path, &s, &error), LAM_ERR_FORMAT, path);
    ck_assert_ptr_null(s);
}
END_TEST

/* A file that was written but never sealed, rescued under the target's name. */
START_TEST(an_unsealed_file_is_refused) {
    store *s = NULL;
    char rescued[160];
    snprintf(rescued, sizeof rescued, "%s/rescued.h5", folder);
    ck_ok(store_create(path, &s, &error));
    ck_ok(sample_fill(s, 1, &error));
    ck_assert_int_eq(link(s->partial, rescued), 0);
    store_close(s);
    s = NULL;
    lam_status status = store_open(rescued, &s, &error);
    ck_assert_msg(status == LAM_ERR_FORMAT || status == LAM_ERR_DAMAGED, "%s", lam_status_text(status));
    ck_assert_ptr_null(s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("store");
    TCase *tests = tcase_create("store");
    tcase_set_timeout(tests, 120);
    tcase_add_checked_fixture(tests, setup, teardown);
    tcase_add_test(tests, arrays_come_back);
    tcase_add_test(tests, values_keep_their_type);
    tcase_add_test(tests, large_arrays_come_back);
    tcase_add_test(tests, texts_come_back);
    tcase_add_test(tests, attributes_come_back);
    tcase_add_test(tests, created_is_a_date);
    tcase_add_test(tests, wrong_requests_are_refused);
    tcase_add_test(tests, bad_names_are_not_written);
    tcase_add_test(tests, an_array_is_written_once);
    tcase_add_test(tests, group_bytes_are_counted);
    tcase_add_test(tests, equal_input_gives_equal_bytes);
    tcase_add_test(tests, a_copy_has_all_but_what_is_skipped);
    tcase_add_test(tests, nothing_is_left_without_a_seal);
    tcase_add_test(tests, a_seal_replaces_the_older_file_whole);
    tcase_add_test(tests, stores_do_not_lock_each_other);
    tcase_add_test(tests, mode_and_link_are_those_of_any_file);
    tcase_add_test(tests, targets_that_cannot_be);
    tcase_add_test(tests, what_is_no_store_is_refused);
    tcase_add_test(tests, an_unsealed_file_is_refused);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
