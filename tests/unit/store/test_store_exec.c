/* A program that is started while stores are open gets none of their descriptors. */
#include "store/store.h"
#include "support/store_sample.h"
#include "support/suite.h"

#include <fcntl.h>
#include <string.h>
#include <unistd.h>

START_TEST(descriptors_are_closed_on_exec) {
    store *s = NULL, *reader = NULL;
    char folder[64], path[128], other[160];
    lam_error error = {.message = ""};
    sample_folder(folder);
    snprintf(path, sizeof path, "%s/store.h5", folder);
    snprintf(other, sizeof other, "%s/other.h5", folder);
    ck_ok(sample_write(path, 1, &error));
    ck_ok(store_open(path, &reader, &error));
    ck_ok(store_create(other, &s, &error));
    int files = 0;
    for (int fd = 3; fd < 1024; fd++) {
        char link[64], name[256];
        snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
        ssize_t length = readlink(link, name, sizeof name - 1);
        if (length < 0) continue;
        name[length] = '\0';
        if (strncmp(name, folder, strlen(folder)) != 0) continue;
        ck_assert_int_ne(fcntl(fd, F_GETFD) & FD_CLOEXEC, 0);
        files++;
    }
    ck_assert_int_eq(files, 2);
    store_close(reader);
    store_close(s);
    sample_folder_remove(folder);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("store and exec");
    TCase *tests = tcase_create("store and exec");
    tcase_add_test(tests, descriptors_are_closed_on_exec);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
