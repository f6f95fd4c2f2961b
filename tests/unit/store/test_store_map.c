/* Arrays of a mapped store: where they lie, how long they live, what a comparison finds. */
#include "store/store_map.h"
#include "support/suite.h"

#include <errno.h>
#include <fcntl.h>
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { LARGE = 700001, SMALL = 100 }; /* 2.67 MiB of floats, and what is not worth a mapping */

static char folder[64], path[96];

static void make_folder(void) {
    snprintf(folder, sizeof folder, "/tmp/store_map_XXXXXX");
    ck_assert_ptr_nonnull(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/s.h5", folder);
}

static void remove_folder(void) {
    unlink(path);
    rmdir(folder);
}

static float value_at(size_t i) {
    return (float)(i % 1000) - 7.0f;
}

/* Its large array has `value` at place `at`; none at LARGE. */
static void write_store_with(size_t at, float value) {
    store *s = NULL;
    lam_error error = {.message = ""};
    float *values = malloc(LARGE * sizeof *values);
    const size_t dims[2] = {1, LARGE}, small = SMALL;
    for (size_t i = 0; i < LARGE; i++) values[i] = i == at ? value : value_at(i);
    ck_assert_msg(store_create(path, &s, &error) == LAM_OK, "%s", error.message);
    ck_assert(store_write(s, "/a/large", STORE_F32, 2, dims, values, &error) == LAM_OK);
    ck_assert(store_write(s, "/a/small", STORE_F32, 1, &small, values, &error) == LAM_OK);
    ck_assert_msg(store_seal(s, &error) == LAM_OK, "%s", error.message);
    free(values);
}

static void write_store(void) {
    write_store_with(LARGE, 0);
}

static store *open_mapped(void) {
    store *s = NULL;
    lam_error error = {.message = ""};
    ck_assert_msg(store_open(path, &s, &error) == LAM_OK, "%s", error.message);
    ck_assert_ptr_null(store_map_of(s));
    ck_assert_msg(store_map_file(s, &error) == LAM_OK, "%s", error.message);
    return s;
}

static store_view view_of(store *s, const char *name, int rank) {
    store_view view = {.data = NULL};
    lam_error error = {.message = ""};
    size_t dims[STORE_MAX_RANK] = {SIZE_MAX, SIZE_MAX};
    ck_assert_msg(store_read_view(s, name, STORE_F32, rank, dims, &view, &error) == LAM_OK, "%s",
                  error.message);
    ck_assert_uint_eq(dims[0], rank == 2 ? 1 : SMALL);
    return view;
}

/* Where in the file an array begins: by its values, of which the first thousand are found once. */
static long place_of_large(void) {
    store *s = open_mapped();
    store_view view = view_of(s, "/a/large", 2);
    const void *begin;
    size_t bytes;
    store_map_range(view.map, &begin, &bytes);
    const long place = (long)((const char *)view.data - (const char *)begin);
    store_view_free(&view);
    store_close(s);
    return place;
}

START_TEST(large_arrays_lie_in_the_file) {
    write_store();
    store *s = open_mapped();
    store_view large = view_of(s, "/a/large", 2), again = view_of(s, "/a/large", 2),
               small = view_of(s, "/a/small", 1);
    const void *begin;
    size_t bytes;
    ck_assert_ptr_nonnull(large.map);
    ck_assert_ptr_null(large.memory);
    ck_assert_ptr_eq(large.data, again.data);
    ck_assert_ptr_null(small.map);
    ck_assert_ptr_eq(small.data, small.memory);
    store_map_range(large.map, &begin, &bytes);
    ck_assert_uint_eq((uintptr_t)begin % ((size_t)2 << 20), 0); /* or no huge page could hold it */
    const uintptr_t first = (uintptr_t)begin, at = (uintptr_t)large.data;
    ck_assert(at >= first && at - first + LARGE * sizeof(float) + STORE_MAP_SLACK <= bytes);
    ck_assert_uint_eq(at % 4096, 0);
    ck_assert_uint_eq(store_map_bytes(large.map), LARGE * sizeof(float)); /* once, though given out twice */
    store_view_free(&again);
    store_view_free(&small);
    /* It outlives the store, and the file's name. */
    store_close(s);
    unlink(path);
    ck_assert(!store_map_changed(large.map));
    for (size_t i = 0; i < LARGE; i++) ck_assert(((const float *)large.data)[i] == value_at(i));
    lam_error error = {.message = ""};
    ck_assert_msg(store_map_verify(large.map, NULL, &error) == LAM_OK, "%s", error.message);
    /* Memory behind the last array can be read as far as was promised. */
    volatile unsigned char sum = 0;
    for (size_t i = 0; i < STORE_MAP_SLACK; i++)
        sum = (unsigned char)(sum + ((const unsigned char *)begin)[bytes - 1 - i]);
    ck_assert_uint_eq(sum, 0);
    store_view_free(&large);
}
END_TEST

START_TEST(a_store_that_is_not_mapped_is_read) {
    write_store();
    store *s = NULL;
    lam_error error = {.message = ""};
    ck_assert(store_open(path, &s, &error) == LAM_OK);
    store_view view = view_of(s, "/a/large", 2);
    ck_assert_ptr_null(view.map);
    store_close(s);
    for (size_t i = 0; i < LARGE; i++) ck_assert(((const float *)view.data)[i] == value_at(i));
    store_view_free(&view);
}
END_TEST

START_TEST(other_types_and_shapes_are_refused) {
    write_store();
    store *s = open_mapped();
    store_view view = {.data = NULL};
    lam_error error = {.message = ""};
    ck_assert(store_read_view(s, "/a/large", STORE_F64, 2, (size_t[]){SIZE_MAX, SIZE_MAX}, &view, &error) ==
              LAM_ERR_FORMAT);
    ck_assert(store_read_view(s, "/a/large", STORE_F32, 1, (size_t[]){SIZE_MAX}, &view, &error) ==
              LAM_ERR_FORMAT);
    ck_assert(store_read_view(s, "/a/large", STORE_F32, 2, (size_t[]){2, SIZE_MAX}, &view, &error) ==
              LAM_ERR_FORMAT);
    ck_assert(store_read_view(s, "/a/none", STORE_F32, 1, (size_t[]){SIZE_MAX}, &view, &error) ==
              LAM_ERR_FORMAT);
    ck_assert_ptr_null(view.data);
    ck_assert_uint_eq(store_map_bytes(store_map_of(s)), 0);
    store_close(s);
}
END_TEST

/* Any bit of any piece: the first, one in the middle, the last. */
START_TEST(a_flipped_bit_is_named) {
    static const size_t places[] = {0, ((size_t)1 << 20) + 17, LARGE * sizeof(float) - 1};
    write_store();
    const long begin = place_of_large();
    for (size_t i = 0; i < 3; i++) {
        lam_error error = {.message = ""};
        unsigned char byte;
        char wanted[64];
        store *s = open_mapped();
        store_view view = view_of(s, "/a/large", 2);
        const int fd = open(path, O_RDWR);
        ck_assert(pread(fd, &byte, 1, begin + (long)places[i]) == 1);
        byte ^= 4;
        ck_assert(pwrite(fd, &byte, 1, begin + (long)places[i]) == 1);
        ck_assert(store_map_verify(view.map, NULL, &error) == LAM_ERR_DAMAGED);
        snprintf(wanted, sizeof wanted, "/a/large is damaged in MiB %zu of 3", (places[i] >> 20) + 1);
        ck_assert_msg(strstr(error.message, wanted) != NULL && strstr(error.message, path) != NULL, "%s",
                      error.message);
        byte ^= 4;
        ck_assert(pwrite(fd, &byte, 1, begin + (long)places[i]) == 1);
        ck_assert(store_map_verify(view.map, NULL, &error) == LAM_OK);
        ck_assert(store_map_changed(view.map)); /* though it is as it was */
        close(fd);
        store_view_free(&view);
        store_close(s);
    }
}
END_TEST

/* The number may be in any piece, with right checksums. It is read as the type of the array, since the bits
 * of another may mean anything. */
START_TEST(a_number_that_is_not_finite_is_named) {
    static const size_t places[] = {0, ((size_t)1 << 18) + 5, LARGE - 1};
    static const float values[] = {INFINITY, -INFINITY, NAN};
    for (size_t i = 0; i < 3; i++) {
        lam_error error = {.message = ""};
        char wanted[96];
        write_store_with(places[i], values[i]);
        store *s = open_mapped();
        store_view view = view_of(s, "/a/large", 2);
        ck_assert(store_map_verify(view.map, NULL, &error) == LAM_ERR_DAMAGED);
        snprintf(wanted, sizeof wanted, "/a/large has a number that is not finite in MiB %zu of 3",
                 (places[i] >> 18) + 1);
        ck_assert_msg(strstr(error.message, wanted) != NULL && strstr(error.message, path) != NULL, "%s",
                      error.message);
        store_view_free(&view);
        store_close(s);
    }
    write_store_with(5, FLT_MAX);
    store *s = open_mapped();
    store_view view = view_of(s, "/a/large", 2);
    lam_error error = {.message = ""};
    ck_assert_msg(store_map_verify(view.map, NULL, &error) == LAM_OK, "%s", error.message);
    store_view_free(&view);
    store_close(s);
}
END_TEST

/* Checks one mapped array of these bytes, as the type. */
static lam_status verify_as(store_type type, const void *values, size_t count) {
    store *s = NULL;
    store_view view = {.data = NULL};
    lam_error error = {.message = ""};
    size_t dims[STORE_MAX_RANK] = {count};
    ck_assert_msg(store_create(path, &s, &error) == LAM_OK, "%s", error.message);
    ck_assert(store_write(s, "/a/large", type, 1, dims, values, &error) == LAM_OK);
    ck_assert_msg(store_seal(s, &error) == LAM_OK, "%s", error.message);
    s = open_mapped();
    ck_assert(store_read_view(s, "/a/large", type, 1, dims, &view, &error) == LAM_OK);
    ck_assert_ptr_nonnull(view.map);
    const lam_status status = store_map_verify(view.map, NULL, &error);
    store_view_free(&view);
    store_close(s);
    return status;
}

START_TEST(every_type_is_looked_at_as_what_it_is) {
    static const store_type types[] = {STORE_I8, STORE_F16, STORE_U32, STORE_F64};
    const size_t bytes = (size_t)3 << 20;
    unsigned char *values = malloc(bytes);
    for (size_t t = 0; t < sizeof types / sizeof *types; t++) {
        const size_t size = store_type_size(types[t]);
        const bool real = types[t] == STORE_F16 || types[t] == STORE_F64;
        memset(values, 0x3f, bytes);
        ck_assert(verify_as(types[t], values, bytes / size) == LAM_OK);
        /* The last number gets an exponent of ones in each of the floating types: 7fff.... */
        memset(values + bytes - size, 0xff, size);
        values[bytes - 1] = 0x7f;
        ck_assert(verify_as(types[t], values, bytes / size) == (real ? LAM_ERR_DAMAGED : LAM_OK));
    }
    free(values);
}
END_TEST

/* Bytes up to the limit; each is looked at once. */
static size_t n_seen;

static bool are_small(const void *data, size_t from, size_t to, uint64_t limit) {
    const unsigned char *bytes = data;
    ck_assert_uint_eq(from, n_seen);
    n_seen = to;
    for (size_t i = from; i < to; i++)
        if (bytes[i] > limit) return false;
    return true;
}

START_TEST(a_view_can_have_a_check) {
    const size_t bytes = ((size_t)2 << 20) + 100;
    unsigned char *values = calloc(bytes, 1);
    values[bytes - 1] = 7;
    for (uint64_t limit = 6; limit <= 7; limit++) {
        store *s = NULL;
        store_view view = {.data = NULL};
        lam_error error = {.message = ""};
        ck_assert(store_create(path, &s, &error) == LAM_OK);
        ck_assert(store_write(s, "/a/bytes", STORE_I8, 1, &bytes, values, &error) == LAM_OK);
        ck_assert_msg(store_seal(s, &error) == LAM_OK, "%s", error.message);
        s = open_mapped();
        ck_assert(store_read_view(s, "/a/bytes", STORE_I8, 1, (size_t[]){bytes}, &view, &error) == LAM_OK);
        store_map_populate(view.map);
        store_view_check(&view, are_small, limit, "has a large byte");
        n_seen = 0;
        const lam_status status = store_map_verify(view.map, NULL, &error);
        ck_assert_uint_eq(n_seen, bytes);
        ck_assert(status == (limit < 7 ? LAM_ERR_DAMAGED : LAM_OK));
        ck_assert(limit == 7 || strstr(error.message, "/a/bytes has a large byte in MiB 3 of 3") != NULL);
        store_view_free(&view);
        store_close(s);
    }
    free(values);
}
END_TEST

START_TEST(places_have_names) {
    write_store();
    const size_t begin = (size_t)place_of_large();
    store *s = open_mapped();
    store_view view = view_of(s, "/a/large", 2);
    lam_error error = {.message = ""};
    store_map_name(view.map, begin + ((size_t)2 << 20), "cannot be read", &error);
    ck_assert_ptr_nonnull(strstr(error.message, "/a/large cannot be read in MiB 3 of 3"));
    ck_assert_int_eq(error.status, LAM_ERR_DAMAGED);
    store_map_name(view.map, begin - 1, "cannot be read", &error);
    ck_assert_ptr_null(strstr(error.message, "/a/large"));
    store_view_free(&view);
    store_close(s);
}
END_TEST

/* Stops the second time that it is asked. context: a size_t. */
static bool is_second(void *context) {
    return ++*(size_t *)context == 2;
}

START_TEST(a_comparison_can_be_stopped) {
    write_store();
    store *s = open_mapped();
    store_view view = view_of(s, "/a/large", 2);
    lam_error error = {.message = ""};
    size_t asked = 0;
    const stop_check stop = {is_second, &asked};
    ck_assert(store_map_verify(view.map, &stop, &error) == LAM_ERR_CANCELLED);
    ck_assert_uint_eq(asked, 2);
    store_view_free(&view);
    store_close(s);
}
END_TEST

/* A file that ends too early is refused before anything of it is mapped. */
START_TEST(a_truncated_file_is_refused) {
    write_store();
    const long begin = place_of_large();
    store *s = NULL;
    lam_error error = {.message = ""};
    ck_assert_int_eq(truncate(path, begin + (long)(LARGE * sizeof(float)) - 1), 0);
    ck_assert(store_open(path, &s, &error) != LAM_OK);
    ck_assert_ptr_null(s);
}
END_TEST

START_TEST(identities_tell_files_apart) {
    write_store();
    store *s = open_mapped();
    const store_identity first = *store_identity_of(s);
    ck_assert_uint_eq(strlen(first.digest), 16);
    store_close(s);
    s = open_mapped();
    ck_assert(store_identity_same(&first, store_identity_of(s)));
    store_close(s);
    unlink(path);
    write_store();
    s = open_mapped();
    ck_assert(!store_identity_same(&first, store_identity_of(s)));
    ck_assert_str_eq(first.digest, store_identity_of(s)->digest); /* the same values */
    store_close(s);
}
END_TEST

START_TEST(a_group_is_verified_alone) {
    write_store();
    const long begin = place_of_large();
    store *s = open_mapped();
    lam_error error = {.message = ""};
    const int fd = open(path, O_RDWR);
    ck_assert(pwrite(fd, "x", 1, begin) == 1);
    close(fd);
    ck_assert(store_verify_group(s, "/b", &error) == LAM_OK);
    ck_assert(store_verify_group(s, "/a", &error) == LAM_ERR_DAMAGED);
    ck_assert(store_verify(s, &error) == LAM_ERR_DAMAGED);
    store_close(s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("store_map");
    TCase *tests = tcase_create("store_map");
    tcase_add_checked_fixture(tests, make_folder, remove_folder);
    tcase_add_test(tests, large_arrays_lie_in_the_file);
    tcase_add_test(tests, a_store_that_is_not_mapped_is_read);
    tcase_add_test(tests, other_types_and_shapes_are_refused);
    tcase_add_test(tests, a_flipped_bit_is_named);
    tcase_add_test(tests, a_number_that_is_not_finite_is_named);
    tcase_add_test(tests, every_type_is_looked_at_as_what_it_is);
    tcase_add_test(tests, a_view_can_have_a_check);
    tcase_add_test(tests, places_have_names);
    tcase_add_test(tests, a_comparison_can_be_stopped);
    tcase_add_test(tests, a_truncated_file_is_refused);
    tcase_add_test(tests, identities_tell_files_apart);
    tcase_add_test(tests, a_group_is_verified_alone);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
