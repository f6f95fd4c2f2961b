/* The parts of the codec that hold no request: sets of indices, names of groups, classes of problems. */
#include "solver/codec/json_parser.h"
#include "solver/codec/problem.h"
#include "solver/operator/groups/groups.h"
#include "support/request_text.h"
#include "support/suite.h"

#include <stdlib.h>
#include <string.h>

static double next_random(uint64_t *state) {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return (double)(*state >> 11) * 0x1p-53;
}

START_TEST(a_set_knows_what_it_holds) {
    enum { SPAN = 5000 };
    static bool known[SPAN];
    index_set set = {0};
    uint64_t state = 99;
    for (int round = 0; round < 5; round++) {
        size_t count = 0;
        memset(known, 0, sizeof known);
        for (int k = 0; k < (round % 2 == 0 ? 8000 : 40); k++) {
            /* Multiples of a large power of two fall together in a poor hash. */
            const uint32_t index = (uint32_t)(next_random(&state) * SPAN),
                           at = index * (round == 2 ? 1u << 19 : 1);
            ck_assert_int_eq(index_set_add(&set, at), known[index] ? INDEX_SET_KNOWN : INDEX_SET_ADDED);
            count += !known[index];
            known[index] = true;
        }
        ck_assert_uint_eq(set.count, count);
        index_set_clear(&set);
        ck_assert_uint_eq(set.count, 0);
    }
    index_set_free(&set);
}
END_TEST

/* Every element is a group. */
static group_index make_groups(size_t n, const char *const *names) {
    uint32_t *group = calloc(n, sizeof *group);
    for (size_t g = 0; g < n; g++) group[g] = (uint32_t)g;
    const group_index groups = named_groups(n, group, n, names);
    free(group);
    return groups;
}

START_TEST(a_miss_suggests_or_lists) {
    static const char *const names[] = {"lamp", "table.top", "table.leg", "a very long name of a group"};
    static const struct {
        const char *name, *text;
    } cases[] = {
        {"lmap", "no group \"lmap\"; did you mean \"lamp\"?"},
        {"tabel", "no group \"tabel\"; did you mean \"table\"?"},
        {"table.pot", "no group \"table.pot\"; did you mean \"table.top\"?"},
        {"xyzzy", "no group \"xyzzy\"; there are: lamp table.top table.leg a very long name of a group"},
        {"", "no group \"\"; there are: lamp table.top table.leg a very long name of a group"},
    };
    group_index groups = make_groups(4, names);
    char text[GROUP_MISS];
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        group_index_miss(&groups, cases[k].name, strlen(cases[k].name), text);
        ck_assert_str_eq(text, cases[k].text);
    }
    group_index_miss(&groups, "lmapXXX", 4, text); /* a name ends at its length */
    ck_assert_str_eq(text, cases[0].text);
    group_index_free(&groups);
}
END_TEST

/* Names of every length, in scenes of many groups and of none, stay within the text. */
START_TEST(a_miss_fits) {
    char long_name[400], text[GROUP_MISS];
    const char *names[40];
    memset(long_name, 'g', sizeof long_name);
    long_name[sizeof long_name - 1] = '\0';
    for (size_t k = 0; k < 40; k++) names[k] = long_name + 10 * k - k / 8;
    group_index groups = make_groups(40, names), none = make_groups(0, NULL);
    for (size_t length = 0; length < sizeof long_name; length++) {
        memset(text, 1, sizeof text);
        char other[sizeof long_name];
        memset(other, length % 2 ? 'g' : 'x', sizeof other);
        group_index_miss(&groups, other, length, text);
        ck_assert_ptr_nonnull(memchr(text, '\0', sizeof text));
        group_index_miss(&none, other, length, text);
        ck_assert_ptr_nonnull(memchr(text, '\0', sizeof text));
    }
    group_index_free(&groups);
    group_index_free(&none);
}
END_TEST

START_TEST(every_problem_has_a_section) {
    for (int k = PROBLEM_NONE + 1; k < PROBLEM_COUNT; k++) {
        const problem_kind kind = (problem_kind)k;
        ck_assert_uint_ge(problem_status(kind), 400);
        ck_assert_uint_lt(problem_status(kind), 600);
        ck_assert_ptr_nonnull(problem_title(kind));
        ck_assert_int_eq(strncmp(problem_type(kind), "deploy/docs/api.md#", 19), 0);
        for (int other = PROBLEM_NONE + 1; other < k; other++) {
            ck_assert_str_ne(problem_type(kind), problem_type((problem_kind)other));
            ck_assert_str_ne(problem_title(kind), problem_title((problem_kind)other));
        }
    }
}
END_TEST

START_TEST(problems_are_written) {
    problem p;
    buffer b = {0};
    ck_assert(!problem_set(&p, PROBLEM_UNKNOWN_GROUP, "no \"%s\"", "x"));
    strcpy(p.pointer, "/a");
    ck_assert(problem_write(&p, &b));
    ck_assert_str_eq(
        b.bytes, "{\"type\":\"deploy/docs/api.md#unknown-group\",\"title\":\"The scene has no group of this "
                 "name\",\"status\":422,\"detail\":\"no \\\"x\\\"\",\"pointer\":\"/a\"}\n");
    buffer_free(&b);
}
END_TEST

/* Indices that all fall into a tenth of the slots of a hash that somebody knows: a set of 2^17 slots of its
 * own factor has no long run of them, so that each is found in a few steps. */
START_TEST(chosen_indices_do_not_meet) {
    enum { ELEMENTS = 655418, SIZE = 1 << 17 };
    index_set set = {0};
    size_t run = 0, longest = 0;
    for (uint32_t i = 0; i < ELEMENTS && set.count < SIZE / 2; i++)
        if (((uint64_t)i * 0x9E3779B97F4A7C15u >> 20 & (SIZE - 1)) < SIZE / 10)
            ck_assert_int_eq(index_set_add(&set, i), INDEX_SET_ADDED);
    ck_assert_uint_gt(set.count, SIZE / 3);
    ck_assert_uint_eq(set.size, SIZE);
    for (size_t k = 0; k < set.size; k++) {
        run = set.slots[k] != UINT32_MAX ? run + 1 : 0;
        longest = run > longest ? run : longest;
    }
    ck_assert_msg(longest < 2000, "%zu slots in a row", longest);
    index_set_free(&set);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("codec_parts");
    TCase *tests = tcase_create("codec_parts");
    tcase_add_test(tests, a_set_knows_what_it_holds);
    tcase_add_test(tests, chosen_indices_do_not_meet);
    tcase_add_test(tests, a_miss_suggests_or_lists);
    tcase_add_test(tests, a_miss_fits);
    tcase_add_test(tests, every_problem_has_a_section);
    tcase_add_test(tests, problems_are_written);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
