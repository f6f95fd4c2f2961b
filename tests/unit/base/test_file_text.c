/* A whole file in memory: its very bytes, a pipe, and files that cannot be read. */
#include "solver/base/file_text.h"
#include "support/suite.h"

#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static lam_error error;

START_TEST(files_of_every_size_are_whole) {
    static const size_t sizes[] = {0, 1, 4095, 4096, 65535, 65536, 300000};
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        char path[] = "/tmp/test-file-text-XXXXXX", *bytes = malloc(sizes[k] + 1), *text = NULL;
        size_t length = 7;
        const int descriptor = mkstemp(path);
        for (size_t i = 0; i < sizes[k]; i++) bytes[i] = (char)(i * 31 % 251);
        ck_assert_int_eq(write(descriptor, bytes, sizes[k]), (ssize_t)sizes[k]);
        close(descriptor);
        ck_assert_int_eq(file_text(path, &text, &length, &error), LAM_OK);
        ck_assert_uint_eq(length, sizes[k]);
        ck_assert(text[length] == '\0' && memcmp(text, bytes, length) == 0);
        unlink(path);
        free(bytes);
        free(text);
    }
}
END_TEST

START_TEST(a_pipe_is_read_to_its_end) {
    enum { LENGTH = 200000 };
    char path[] = "/tmp/test-file-text-XXXXXX", *text = NULL;
    size_t length = 0;
    ck_assert_ptr_nonnull(mkdtemp(path));
    char pipe_path[64];
    snprintf(pipe_path, sizeof pipe_path, "%s/pipe", path);
    ck_assert_int_eq(mkfifo(pipe_path, 0600), 0);
    const pid_t child = fork();
    if (child == 0) {
        FILE *to = fopen(pipe_path, "wb");
        for (int i = 0; i < LENGTH; i++) fputc('a' + i % 26, to);
        fclose(to);
        _exit(0);
    }
    ck_assert_int_eq(file_text(pipe_path, &text, &length, &error), LAM_OK);
    ck_assert_uint_eq(length, LENGTH);
    for (int i = 0; i < LENGTH; i++) ck_assert(text[i] == 'a' + i % 26);
    free(text);
    unlink(pipe_path);
    rmdir(path);
}
END_TEST

START_TEST(what_cannot_be_read_is_named) {
    char *text = NULL;
    size_t length = 0;
    ck_assert_int_eq(file_text("/nonexistent/a.npy", &text, &length, &error), LAM_ERR_IO);
    ck_assert_ptr_nonnull(strstr(error.message, "/nonexistent/a.npy: cannot read: No such file"));
    ck_assert_int_eq(file_text("/tmp", &text, &length, &error), LAM_ERR_IO);
    ck_assert_ptr_null(text);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("file_text");
    TCase *tests = tcase_create("file_text");
    tcase_add_test(tests, files_of_every_size_are_whole);
    tcase_add_test(tests, a_pipe_is_read_to_its_end);
    tcase_add_test(tests, what_cannot_be_read_is_named);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
