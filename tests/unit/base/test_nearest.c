/* The nearest word: what a typing error is, and where nothing is near. */
#include "solver/base/nearest.h"
#include "support/suite.h"

#include <stdbool.h>
#include <string.h>

static const char *const groups[] = {"floor", "lamp", "wall.left", "wall.right", "desk", "lamps"};
enum { N_GROUPS = sizeof groups / sizeof groups[0] };

static const char *near(const char *word) {
    return nearest_word(word, N_GROUPS, groups);
}

START_TEST(each_kind_of_error_counts_as_one) {
    ck_assert_str_eq(near("lmap"), "lamp");
    ck_assert_str_eq(near("flor"), "floor");
    ck_assert_str_eq(near("fllor"), "floor");
    ck_assert_str_eq(near("floorr"), "floor");
    ck_assert_str_eq(near("dask"), "desk");
    ck_assert_str_eq(near("wall.rihgt"), "wall.right");
}
END_TEST

START_TEST(the_least_distance_wins_and_the_first_of_equals) {
    const char *const equals[] = {"bbaa", "abab", "bbab"};
    ck_assert_str_eq(near("lamps"), "lamps");
    ck_assert_str_eq(near("lamp"), "lamp");
    ck_assert_ptr_eq(nearest_word("bbaa", 3, equals), equals[0]);
    ck_assert_ptr_eq(nearest_word("bbaab", 3, equals), equals[0]);
}
END_TEST

/* A third of the longer word is the most: 1 of 3 to 5 bytes, 2 of 6 to 8. */
START_TEST(nothing_is_near_beyond_a_third) {
    const char *const words[] = {"abcdef", "xyz"};
    ck_assert_str_eq(nearest_word("abcd", 2, words), "abcdef");
    ck_assert_ptr_null(nearest_word("abc", 2, words));
    ck_assert_str_eq(nearest_word("xy", 2, words), "xyz");
    ck_assert_ptr_null(nearest_word("x", 2, words));
    ck_assert_ptr_null(nearest_word("", 2, words));
    ck_assert_ptr_null(nearest_word("lamp", 0, NULL));
    ck_assert_ptr_null(near("zzzz"));
}
END_TEST

/* The plain recursion over the definition, for short words over two letters. */
static size_t defined(const char *a, size_t i, const char *b, size_t j) {
    if (i == 0 || j == 0) return i + j;
    size_t least = defined(a, i - 1, b, j) + 1, other = defined(a, i, b, j - 1) + 1;
    if (other < least) least = other;
    other = defined(a, i - 1, b, j - 1) + (a[i - 1] != b[j - 1]);
    if (other < least) least = other;
    if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        other = defined(a, i - 2, b, j - 2) + 1;
        if (other < least) least = other;
    }
    return least;
}

START_TEST(every_pair_of_short_words_agrees_with_the_definition) {
    size_t n_near = 0;
    for (unsigned a = 0; a < 64; a++)
        for (unsigned b = 0; b < 128; b++) {
            char one[7] = {0}, two[8] = {0};
            const char *const words[] = {two};
            for (int k = 0; k < 6; k++) one[k] = (a >> k & 1) != 0 ? 'x' : 'y';
            for (int k = 0; k < 7; k++) two[k] = (b >> k & 1) != 0 ? 'x' : 'y';
            const bool is_near = defined(one, 6, two, 7) <= 7 / 3;
            ck_assert((nearest_word(one, 1, words) != NULL) == is_near);
            n_near += is_near;
        }
    ck_assert_uint_gt(n_near, 100);
    ck_assert_uint_lt(n_near, 64 * 128 - 100);
}
END_TEST

START_TEST(long_words_are_not_compared) {
    char just[NEAREST_LENGTH_MAX + 1], beyond[NEAREST_LENGTH_MAX + 2];
    const char *words[] = {just};
    memset(just, 'a', sizeof just);
    memset(beyond, 'a', sizeof beyond);
    just[NEAREST_LENGTH_MAX] = beyond[NEAREST_LENGTH_MAX + 1] = '\0';
    ck_assert_ptr_eq(nearest_word(just, 1, words), just);
    ck_assert_ptr_null(nearest_word(beyond, 1, words));
    words[0] = beyond;
    ck_assert_ptr_null(nearest_word(just, 1, words));
}
END_TEST

int main(void) {
    Suite *suite = suite_create("nearest");
    TCase *tests = tcase_create("nearest");
    tcase_add_test(tests, each_kind_of_error_counts_as_one);
    tcase_add_test(tests, the_least_distance_wins_and_the_first_of_equals);
    tcase_add_test(tests, nothing_is_near_beyond_a_third);
    tcase_add_test(tests, every_pair_of_short_words_agrees_with_the_definition);
    tcase_add_test(tests, long_words_are_not_compared);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
