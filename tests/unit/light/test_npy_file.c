/* NPY files: what is written is read back; what is cut, foreign or of another kind is refused. */
#include "solver/light/npy_file.h"
#include "support/suite.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* A fresh file with this content; the caller unlinks it. */
static void write_file(char path[32], const void *data, size_t size) {
    strcpy(path, "/tmp/test-npy-XXXXXX");
    int descriptor = mkstemp(path);
    ck_assert_int_ge(descriptor, 0);
    ck_assert_int_eq(write(descriptor, data, size), (ssize_t)size);
    close(descriptor);
}

/* A version 1 file around a header text and values. */
static size_t compose(unsigned char *out, const char *header, const void *values, size_t size) {
    const size_t length = strlen(header);
    memcpy(out, "\x93NUMPY\x01\x00", 8);
    out[8] = (unsigned char)(length & 0xFF);
    out[9] = (unsigned char)(length >> 8);
    memcpy(out + 10, header, length);
    if (size > 0) memcpy(out + 10 + length, values, size);
    return 10 + length + size;
}

static lam_status read_bytes(const void *data, size_t size, npy *a, lam_error *error) {
    char path[32];
    write_file(path, data, size);
    lam_status status = npy_read(path, a, error);
    unlink(path);
    return status;
}

START_TEST(test_written_is_read) {
    const float values[12] = {0, 1.5f, -2, 3e-40f, 5, 6, 7, 8, 9, 10, 11, 12};
    char *data = NULL;
    size_t size = 0;
    npy a = {0};
    lam_error error;
    FILE *stream = open_memstream(&data, &size);
    npy_write(stream, 3, (const size_t[]){2, 3, 2}, values);
    fclose(stream);
    ck_assert_uint_eq((size - sizeof values) % 64, 0);
    ck_assert_int_eq(read_bytes(data, size, &a, &error), LAM_OK);
    ck_assert_int_eq(a.rank, 3);
    ck_assert_uint_eq(a.dims[0], 2);
    ck_assert_uint_eq(a.dims[1], 3);
    ck_assert_uint_eq(a.dims[2], 2);
    for (size_t i = 0; i < 12; i++) ck_assert_double_eq(a.values[i], (double)values[i]);
    npy_free(&a);
    /* Every shorter file is refused. */
    for (size_t cut = 0; cut < size; cut++) {
        npy b = {0};
        ck_assert_int_ne(read_bytes(data, cut, &b, &error), LAM_OK);
        ck_assert_ptr_null(b.values);
    }
    free(data);
}
END_TEST

START_TEST(test_doubles) {
    const double values[3] = {1, -2.25, 1e300};
    unsigned char file[256];
    npy a = {0};
    lam_error error;
    size_t size =
        compose(file, "{'shape': (3,), 'fortran_order': False, 'descr': '<f8'}\n", values, sizeof values);
    ck_assert_int_eq(read_bytes(file, size, &a, &error), LAM_OK);
    ck_assert_int_eq(a.rank, 1);
    ck_assert_mem_eq(a.values, values, sizeof values);
    npy_free(&a);
}
END_TEST

START_TEST(test_refused) {
    static const char *const headers[] = {
        "{'descr': '>f4', 'fortran_order': False, 'shape': (1,), }\n",
        "{'descr': '<i4', 'fortran_order': False, 'shape': (1,), }\n",
        "{'descr': '<f4', 'fortran_order': True, 'shape': (1,), }\n",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (2,), }\n",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (), }\n",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (1,1,1,1), }\n",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (-1,), }\n",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (18446744073709551616,), }\n",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (4294967296,4294967296,4), }\n",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (1,\n",
        "{'descr': '<f4', 'fortran_order': False}\n",
        "{'fortran_order': False, 'shape': (1,), }\n",
        "{'descr': '<f4', 'shape': (1,), }\n",
        "{'descr",
        "",
    };
    const float value = 1;
    lam_error error;
    for (size_t i = 0; i < sizeof headers / sizeof headers[0]; i++) {
        unsigned char file[256];
        npy a = {0};
        size_t size = compose(file, headers[i], &value, sizeof value);
        ck_assert_msg(read_bytes(file, size, &a, &error) == LAM_ERR_FORMAT, "was read: %s", headers[i]);
        ck_assert_ptr_null(a.values);
        ck_assert_ptr_nonnull(strstr(error.message, "/tmp/test-npy-"));
    }
    npy a = {0};
    ck_assert_int_eq(read_bytes("PK", 2, &a, &error), LAM_ERR_FORMAT);
    ck_assert_int_eq(read_bytes("\x93NUMPY\x09\x00\x00\x00", 10, &a, &error), LAM_ERR_VERSION);
    ck_assert_int_eq(npy_read("/nonexistent/a.npy", &a, &error), LAM_ERR_IO);
    ck_assert_int_eq(npy_read("/tmp", &a, &error), LAM_ERR_IO);
}
END_TEST

int main(void) {
    Suite *s = suite_create("npy");
    TCase *c = tcase_create("all");
    tcase_set_timeout(c, 60);
    tcase_add_test(c, test_written_is_read);
    tcase_add_test(c, test_doubles);
    tcase_add_test(c, test_refused);
    suite_add_tcase(s, c);
    return suite_run(s);
}
