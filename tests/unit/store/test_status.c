/* The error idiom and the checked sizes. */
#include "support/suite.h"

#include "store/status.h"

#include <stdint.h>
#include <string.h>

static int released;

static lam_status open_two(int fails_at, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(fails_at == 1 ? status_fail(error, LAM_ERR_IO, "first") : LAM_OK);
    if (fails_at == 2) FAIL(error, LAM_ERR_NUMERIC, "reflectance[%d] = %.1f, must be below 1", 17, 1.2);
done:
    released++;
    return status;
}

START_TEST(leaves_by_one_way) {
    lam_error error = {LAM_OK, "untouched"};
    released = 0;
    ck_assert_int_eq(open_two(0, &error), LAM_OK);
    ck_assert_str_eq(error.message, "untouched");
    ck_assert_int_eq(open_two(1, &error), LAM_ERR_IO);
    ck_assert_int_eq(error.status, LAM_ERR_IO);
    ck_assert_str_eq(error.message, "first");
    ck_assert_int_eq(open_two(2, &error), LAM_ERR_NUMERIC);
    ck_assert_str_eq(error.message, "reflectance[17] = 1.2, must be below 1");
    ck_assert_int_eq(open_two(2, NULL), LAM_ERR_NUMERIC);
    ck_assert_int_eq(released, 4);
}
END_TEST

START_TEST(message_is_one_line) {
    lam_error error;
    status_fail(&error, LAM_ERR_FORMAT, "a\nb\tc\x1b[1m\x7f ä");
    ck_assert_str_eq(error.message, "a?b?c?[1m? ä");
}
END_TEST

/* A message of any length fits, and a character of two or three bytes is whole or gone. */
START_TEST(message_is_cut_between_characters) {
    char text[700];
    lam_error error;
    for (size_t shift = 0; shift < 6; shift++) {
        memset(text, 'x', shift);
        text[shift] = '\0';
        while (strlen(text) < 600) strcat(text, "ä☼");
        status_fail(&error, LAM_ERR_IO, "%s", text);
        size_t length = strlen(error.message);
        ck_assert_uint_lt(length, sizeof error.message);
        ck_assert_uint_gt(length, sizeof error.message - 8);
        ck_assert_mem_eq(error.message, text, length);
        ck_assert_int_ne(text[length] & 0xC0, 0x80); /* the text after the cut begins a character */
    }
}
END_TEST

START_TEST(every_status_has_its_text) {
    const lam_status all[] = {
#define STATUS_NAME(code, text) code,
        LAM_STATUS_LIST(STATUS_NAME)
#undef STATUS_NAME
    };
    size_t count = sizeof all / sizeof *all;
    ck_assert_uint_gt(count, 5);
    for (size_t i = 0; i < count; i++) {
        ck_assert_uint_gt(strlen(lam_status_text(all[i])), 0);
        for (size_t j = 0; j < i; j++) ck_assert_str_ne(lam_status_text(all[i]), lam_status_text(all[j]));
    }
    ck_assert_ptr_nonnull(lam_status_text((lam_status)12345));
}
END_TEST

START_TEST(sizes_do_not_wrap) {
    size_t product = 7;
    ck_assert(size_multiply(6, 7, &product));
    ck_assert_uint_eq(product, 42);
    ck_assert(size_multiply(SIZE_MAX, 1, &product));
    ck_assert_uint_eq(product, SIZE_MAX);
    ck_assert(size_multiply(0, SIZE_MAX, &product));
    ck_assert_uint_eq(product, 0);
    product = 7;
    ck_assert(!size_multiply(SIZE_MAX / 2 + 1, 2, &product));
    ck_assert(!size_multiply((size_t)1 << 33, (size_t)1 << 33, &product));
    ck_assert_uint_eq(product, 7);
}
END_TEST

START_TEST(memory_is_zeroed_and_checked) {
    lam_error error = {LAM_OK, ""};
    unsigned char *memory = memory_allocate(1000, 3, "mesh", &error);
    ck_assert_ptr_nonnull(memory);
    for (size_t i = 0; i < 3000; i++) ck_assert_uint_eq(memory[i], 0);
    free(memory);
    void *none = memory_allocate(0, 8, "mesh", &error);
    ck_assert_ptr_nonnull(none);
    free(none);
    ck_assert_int_eq(error.status, LAM_OK);
    ck_assert_ptr_null(memory_allocate(SIZE_MAX / 4, 8, "mesh", &error));
    ck_assert_int_eq(error.status, LAM_ERR_MEMORY);
    ck_assert_ptr_nonnull(strstr(error.message, "mesh"));
    ck_assert_ptr_null(memory_allocate(SIZE_MAX / 8, 8, "mesh", NULL));
}
END_TEST

int main(void) {
    Suite *suite = suite_create("status");
    TCase *tests = tcase_create("status");
    tcase_set_timeout(tests, 60);
    tcase_add_test(tests, leaves_by_one_way);
    tcase_add_test(tests, message_is_one_line);
    tcase_add_test(tests, message_is_cut_between_characters);
    tcase_add_test(tests, every_status_has_its_text);
    tcase_add_test(tests, sizes_do_not_wrap);
    tcase_add_test(tests, memory_is_zeroed_and_checked);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
