/* Headers that are read without HDF5 are those that HDF5 reads, byte for byte; whatever was changed is left
 * to HDF5, or nothing follows from it, and no content of a block leads out of memory. */
#include "solver/base/random.h"
#include "store/plain.h"
#include "support/store_sample.h"
#include "support/suite.h"

#include <fcntl.h>
#include <sys/stat.h>

static char folder[64], path[128];
static lam_error error;

static void setup(void) {
    sample_folder(folder);
    snprintf(path, sizeof path, "%s/store.h5", folder);
    error = (lam_error){.message = ""};
}

static void teardown(void) {
    sample_folder_remove(folder);
}

/* Names that lie in the header of their group or in a heap of one block, of rows of blocks, below a tree of
 * two levels; attributes likewise. */
typedef struct shape {
    size_t n_links, n_attributes, longest; /* letters of an attribute's text */
} shape;

static const shape shapes[] = {{0, 0, 0},   {1, 1, 1},     {8, 8, 20},    {9, 9, 20},
                               {40, 28, 9}, {60, 40, 300}, {200, 90, 70}, {250, 250, 500}};
enum { SHAPES = sizeof shapes / sizeof *shapes };

static void write_shape(const shape *k) {
    store *s = NULL;
    char name[64], text[512];
    ck_ok(store_create(path, &s, &error));
    ck_ok(sample_fill(s, 3, &error));
    for (size_t i = 0; i < k->n_links; i++) {
        const size_t dims[] = {i % 5 * 300};
        unsigned char *bytes = sample_values(dims[0] * 8, i + 1);
        snprintf(name, sizeof name, "/many/%zu-%.*s", i * 7919 % 1000, (int)(i % 30),
                 "abcdefghijklmnopqrstuvwxyzabcd");
        ck_ok(store_write(s, name, (store_type)(i % 7), 1, dims, bytes, &error));
        free(bytes);
    }
    ck_ok(store_set_number(s, "/many", "one", .5, &error));
    for (size_t i = 0; i < k->n_attributes; i++) {
        snprintf(name, sizeof name, "attribute %zu", i * 6007 % 1000);
        memset(text, 'a' + (int)(i % 26), sizeof text);
        text[i * 37 % (k->longest + 1)] = '\0';
        if (i % 3 == 0)
            ck_ok(store_set_text(s, "/few/deep/group", name, text, &error));
        else if (i % 3 == 1)
            ck_ok(store_set_integer(s, "/few/deep/group", name, (int64_t)i - 5, &error));
        else
            ck_ok(store_set_number(s, "/few/deep/group", name, 1 / (double)i, &error));
    }
    ck_ok(store_seal(s, &error));
}

static store *open_file(void) {
    store *s = NULL;
    struct stat info;
    ck_ok(store_new(path, &s, &error));
    s->file.fd = open(path, O_RDONLY);
    ck_assert_int_eq(fstat(s->file.fd, &info), 0);
    s->file.size = (uint64_t)info.st_size;
    return s;
}

/* The reply of HDF5; the caller frees. */
static char *by_hdf5(reply_head *head) {
    char name[160];
    size_t size;
    store *s = open_file();
    snprintf(name, sizeof name, "%s/reply", folder);
    const int to = open(name, O_CREAT | O_TRUNC | O_WRONLY, 0600);
    store_headers_send(s, to);
    close(to);
    store_close(s);
    unsigned char *all = sample_load(name, &size);
    ck_assert_uint_ge(size, sizeof *head);
    memcpy(head, all, sizeof *head);
    ck_assert_uint_eq(head->bytes, size - sizeof *head);
    char *bytes = malloc(size);
    memcpy(bytes, all + sizeof *head, (size_t)head->bytes);
    free(all);
    return bytes;
}

START_TEST(replies_are_those_of_hdf5) {
    reply_head wanted, head;
    char *bytes = NULL;
    write_shape(&shapes[_i]);
    char *expected = by_hdf5(&wanted);
    store *s = open_file();
    ck_assert_msg(plain_headers(s, &head, &bytes), "shape %d is not read", _i);
    ck_assert_mem_eq(&head, &wanted, sizeof head);
    ck_assert_mem_eq(bytes, expected, (size_t)head.bytes);
    store_close(s);
    free(bytes);
    free(expected);
}
END_TEST

/* A file in memory whose bytes are changed and written back one by one. */
static int change(const unsigned char *all, size_t at, size_t count) {
    const int fd = open(path, O_WRONLY);
    const ssize_t done = pwrite(fd, all + at, count, (off_t)at);
    close(fd);
    return done == (ssize_t)count;
}

static uint64_t state = 9;

static size_t below(size_t n) {
    return (size_t)(random_lcg(&state) >> 33) % n;
}

/* Reads what was changed: true if it is still taken, for `expected` then. */
static bool is_same(const reply_head *wanted, const char *expected) {
    reply_head head;
    char *bytes = NULL;
    store *s = open_file();
    const bool good = plain_headers(s, &head, &bytes);
    if (good && expected != NULL) {
        ck_assert_mem_eq(&head, wanted, sizeof head);
        ck_assert_mem_eq(bytes, expected, (size_t)head.bytes);
    }
    if (good) { /* such a reply is taken for bytes from outside */
        store_index index;
        lam_error unused;
        if (store_reply_check(&head, path, &unused) == LAM_OK &&
            store_reply_read(&head, path, s->file.size, bytes, &index, &unused) == LAM_OK)
            store_index_free(&index);
    }
    store_close(s);
    return good;
}

/* Bytes of numbers are no headers, so that some changes do not count; none is taken for something else. */
START_TEST(damage_is_left_to_hdf5) {
    size_t size, left = 0;
    reply_head wanted;
    write_shape(&shapes[5]);
    char *expected = by_hdf5(&wanted);
    unsigned char *all = sample_load(path, &size);
    for (size_t k = 0; k < 3000; k++) {
        const size_t at = below(size);
        const unsigned char before = all[at];
        all[at] ^= (unsigned char)(1u << below(8));
        ck_assert(change(all, at, 1));
        left += !is_same(&wanted, expected);
        all[at] = before;
        ck_assert(change(all, at, 1));
    }
    ck_assert_uint_gt(left, 300);
    ck_assert_int_eq(truncate(path, (off_t)size - 1), 0);
    ck_assert(!is_same(&wanted, expected));
    ck_assert_int_eq(truncate(path, 40), 0);
    ck_assert(!is_same(&wanted, expected));
    ck_assert_int_eq(truncate(path, 0), 0);
    ck_assert(!is_same(&wanted, expected));
    free(all);
    free(expected);
}
END_TEST

/* The block at a place, with its checksum at its end; 0: there is none. */
static size_t find_block(const unsigned char *all, size_t size, size_t at) {
    static const char letters[][5] = {"OHDR", "OCHK", "FRHP", "FHIB", "BTHD", "BTLF", "BTIN"};
    bool is_block = false;
    for (size_t k = 0; k < sizeof letters / sizeof *letters; k++)
        is_block = is_block || memcmp(all + at, letters[k], 4) == 0;
    for (size_t n = 8; is_block && n <= 4096 && at + n <= size; n++) {
        uint32_t sum;
        memcpy(&sum, all + at + n - 4, sizeof sum);
        if (plain_checksum(all + at, n - 4) == sum) return n;
    }
    return 0;
}

/* Blocks that are changed and have the checksum of what they are then, as somebody may write them who means
 * harm: a sanitizer would tell. */
START_TEST(crafted_blocks_lead_nowhere) {
    enum { BLOCKS = 600 };
    size_t size, n_blocks = 0, at[BLOCKS], bytes[BLOCKS], taken = 0;
    write_shape(&shapes[_i == 0 ? 5 : 6]);
    unsigned char *all = sample_load(path, &size), block[4096];
    for (size_t k = 0; k + 8 <= size && n_blocks < BLOCKS; k++)
        if ((bytes[n_blocks] = find_block(all, size, k)) > 0) at[n_blocks++] = k;
    ck_assert_uint_gt(n_blocks, 30);
    for (size_t k = 0; k < 4000; k++) {
        const size_t b = below(n_blocks), n = bytes[b];
        memcpy(block, all + at[b], n);
        for (size_t count = 1 + below(3); count > 0; count--) {
            static const unsigned char edges[] = {0, 1, 0x7f, 0x80, 0xff};
            const size_t place = 4 + below(n - 8);
            all[at[b] + place] = below(2) == 0 ? edges[below(5)] : (unsigned char)below(256);
        }
        const uint32_t sum = plain_checksum(all + at[b], n - 4);
        memcpy(all + at[b] + n - 4, &sum, sizeof sum);
        ck_assert(change(all, at[b], n));
        taken += is_same(NULL, NULL);
        memcpy(all + at[b], block, n);
        ck_assert(change(all, at[b], n));
    }
    ck_assert_uint_gt(taken, 0); /* texts and numbers of attributes may be anything */
    free(all);
}
END_TEST

/* The function's author gives these (lookup3.c, driver5). */
START_TEST(checksums_are_those_of_lookup3) {
    ck_assert_uint_eq(plain_checksum((const uint8_t *)"", 0), 0xdeadbeef);
    ck_assert_uint_eq(plain_checksum((const uint8_t *)"Four score and seven years ago", 30), 0x17770551);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("plain headers");
    TCase *tests = tcase_create("plain headers");
    tcase_set_timeout(tests, 120);
    tcase_add_checked_fixture(tests, setup, teardown);
    tcase_add_loop_test(tests, replies_are_those_of_hdf5, 0, SHAPES);
    tcase_add_test(tests, damage_is_left_to_hdf5);
    tcase_add_loop_test(tests, crafted_blocks_lead_nowhere, 0, 2);
    tcase_add_test(tests, checksums_are_those_of_lookup3);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
