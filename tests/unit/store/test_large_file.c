/* Arrays in files: grown, cut and kept, bits as in memory, a full disk as an error. */
#include "solver/formfactor/rows/upper.h"
#include "solver/linalg/csr.h"
#include "support/scene.h"
#include "support/square.h"
#include "support/suite.h"

#include <dirent.h>
#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

static size_t files_in(const char *folder) {
    size_t count = 0;
    DIR *d = opendir(folder);
    ck_assert_ptr_nonnull(d);
    while (readdir(d) != NULL) count++;
    closedir(d);
    return count - 2;
}

START_TEST(grown_cut_and_kept) {
    char folder[64];
    lam_error error = {0};
    large_file *f = NULL;
    void *bytes = NULL;
    folder_make(folder);
    const large_place place = {.folder = open(folder, O_RDONLY | O_DIRECTORY), .name = folder};
    ck_assert_int_eq(large_file_create(&place, &f, &error), LAM_OK);
    ck_assert_uint_eq(files_in(folder), 0); /* nothing that a killed run would leave */
    static const size_t sizes[] = {0, 1, 100, 300000, 4097, 900000, 3};
    size_t kept = 0;
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        ck_assert_msg(large_file_resize(f, sizes[k], &bytes, &error) == LAM_OK, "%s", error.message);
        unsigned char *b = bytes;
        if (kept > sizes[k]) kept = sizes[k];
        for (size_t i = 0; i < kept; i++) ck_assert_uint_eq(b[i], (unsigned char)(i % 251 + 1));
        for (size_t i = kept; i < sizes[k]; i++) ck_assert_uint_eq(b[i], 0);
        for (kept = 0; kept < sizes[k]; kept++) b[kept] = (unsigned char)(kept % 251 + 1);
    }
    large_file_free(f);
    large_file_free(NULL);
    close(place.folder);
    folder_remove(folder);
}
END_TEST

/* A limit on the size of files stands for a full disk. */
START_TEST(a_full_disk_is_an_error) {
    char folder[64];
    lam_error error = {0};
    void *bytes = NULL;
    folder_make(folder);
    const large_place place = {.folder = open(folder, O_RDONLY | O_DIRECTORY), .name = folder};
    csr a = {.n = 1, .place = &place};
    struct rlimit before, least = {.rlim_cur = 1 << 20};
    large_file *f = NULL;
    ck_assert_int_eq(large_file_create(&place, &f, &error), LAM_OK);
    ck_assert_int_eq(large_file_resize(f, 1000, &bytes, &error), LAM_OK);
    memset(bytes, 7, 1000);
    ck_assert_int_eq(getrlimit(RLIMIT_FSIZE, &before), 0);
    least.rlim_max = before.rlim_max;
    signal(SIGXFSZ, SIG_IGN);
    ck_assert_int_eq(setrlimit(RLIMIT_FSIZE, &least), 0);
    ck_assert_int_eq(large_file_resize(f, 1 << 22, &bytes, &error), LAM_ERR_IO);
    ck_assert_ptr_nonnull(strstr(error.message, folder));
    for (size_t i = 0; i < 1000; i++) ck_assert_uint_eq(((unsigned char *)bytes)[i], 7);
    ck_assert_int_eq(csr_reserve(&a, 1000, &error), LAM_OK);
    ck_assert_int_eq(csr_reserve(&a, 1 << 20, &error), LAM_ERR_IO);
    ck_assert_int_eq(setrlimit(RLIMIT_FSIZE, &before), 0);
    signal(SIGXFSZ, SIG_DFL);
    ck_assert_int_eq(csr_reserve(&a, 1 << 20, &error), LAM_OK);
    csr_free(&a);
    large_file_free(f);
    close(place.folder);
    error.message[0] = '\0';
    ck_assert_int_eq(large_file_create(&place, &f, &error), LAM_ERR_IO); /* a folder that is not open */
    ck_assert_ptr_nonnull(strstr(error.message, folder));
    folder_remove(folder);
}
END_TEST

static csr rows_of(const square *s, const large_place *place) {
    lam_error error = {0};
    csr F = {0}, sum = {0};
    double *row_sums = malloc(s->n * sizeof *row_sums);
    ck_assert_msg(upper_merge(&s->found, 100000, s->area, place, &F, &error) == LAM_OK, "%s", error.message);
    ck_assert_msg(upper_expand(&F, s->area, row_sums, &error) == LAM_OK, "%s", error.message);
    ck_assert_msg(upper_gather(&F, s->area, &error) == LAM_OK, "%s", error.message);
    ck_assert_msg(upper_expand(&F, s->area, row_sums, &error) == LAM_OK, "%s", error.message);
    ck_assert_msg(csr_replace(&F, &F, &sum, &error) == LAM_OK, "%s", error.message);
    ck_assert((sum.place != NULL) == (place != NULL));
    ck_assert((sum.files[0] != NULL && sum.files[1] != NULL) == (place != NULL));
    ck_assert((F.files[0] != NULL && F.files[1] != NULL) == (place != NULL));
    csr_free(&F);
    free(row_sums);
    return sum;
}

START_TEST(rows_in_files_are_those_in_memory) {
    char folder[64];
    folder_make(folder);
    const large_place place = {.folder = open(folder, O_RDONLY | O_DIRECTORY), .name = folder};
    square s = square_make(700, ROW_WEIGHTS, 8);
    csr memory = rows_of(&s, NULL), disk = rows_of(&s, &place);
    same_rows(&memory, &disk);
    csr_free(&memory);
    csr_free(&disk);
    square_free(&s);
    close(place.folder);
    folder_remove(folder);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("large_file");
    TCase *cases = tcase_create("large_file");
    tcase_set_timeout(cases, 300);
    tcase_add_test(cases, grown_cut_and_kept);
    tcase_add_test(cases, a_full_disk_is_an_error);
    tcase_add_test(cases, rows_in_files_are_those_in_memory);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
