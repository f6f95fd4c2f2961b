/* The readers of numbers and the tables of options. */
#include "solver/console/options.h"
#include "support/suite.h"

#include <math.h>
#include <string.h>
#include <unistd.h>

START_TEST(test_numbers) {
    static const char *const bad[] = {"",     " 1",    "1 ",  "nan", "inf",  "-inf",
                                      "0x10", "1e999", "1,2", "1e",  "--1",  "1.2.3",
                                      "e5",   ".",     "+",   "1f",  "1e5x", "infinity"};
    double value = 7;
    lam_error error;
    ck_assert_int_eq(option_number("--x", "2.5e-3", &value, &error), LAM_OK);
    ck_assert_double_eq(value, 2.5e-3);
    ck_assert_int_eq(option_number("--x", "-.5", &value, &error), LAM_OK);
    ck_assert_double_eq(value, -.5);
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        value = 7;
        ck_assert_msg(option_number("--x", bad[i], &value, &error) == LAM_ERR_ARGUMENT, "'%s' was read",
                      bad[i]);
        ck_assert_double_eq(value, 7);
        ck_assert_ptr_nonnull(strstr(error.message, "--x"));
    }
}
END_TEST

START_TEST(test_counts) {
    static const char *const bad[] = {"",
                                      "-1",
                                      "+1",
                                      "1.0",
                                      "1e3",
                                      " 1",
                                      "0x1",
                                      "1 ",
                                      "abc",
                                      "18446744073709551615",
                                      "99999999999999999999"};
    uint64_t value = 7;
    lam_error error;
    ck_assert_int_eq(option_count("--x", "18446744073709551614", &value, &error), LAM_OK);
    ck_assert_uint_eq(value, UINT64_MAX - 1);
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        value = 7;
        ck_assert_msg(option_count("--x", bad[i], &value, &error) == LAM_ERR_ARGUMENT, "'%s' was read",
                      bad[i]);
        ck_assert_uint_eq(value, 7);
    }
}
END_TEST

START_TEST(test_sizes) {
    static const struct {
        const char *text;
        uint64_t bytes;
    } good[] = {{"1", 1},     {"4096", 4096},    {"2K", 2048},
                {"2k", 2048}, {"1.5M", 3 << 19}, {"16G", UINT64_C(1) << 34}};
    static const char *const bad[] = {"",
                                      "K",
                                      "0",
                                      "-1G",
                                      "1T",
                                      "1GB",
                                      "1 G",
                                      "G1",
                                      "1e9",
                                      "..",
                                      "nan",
                                      "1.2.3K",
                                      "99999999999999999999G",
                                      "0.1"};
    uint64_t value = 7;
    lam_error error;
    for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
        ck_assert_int_eq(option_size("--x", good[i].text, &value, &error), LAM_OK);
        ck_assert_uint_eq(value, good[i].bytes);
    }
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        value = 7;
        ck_assert_msg(option_size("--x", bad[i], &value, &error) == LAM_ERR_ARGUMENT, "'%s' was read",
                      bad[i]);
        ck_assert_uint_eq(value, 7);
    }
}
END_TEST

START_TEST(test_lists_of_numbers) {
    static const char *const bad[] = {"", ",", "1,", ",1", "1,,2", "1,2,3,4", "1;2", "1,nan,3"};
    double values[3] = {7, 7, 7};
    size_t found = 0;
    lam_error error;
    ck_assert_int_eq(option_numbers("--x", "1,-2.5,3e2", 3, true, values, &found, &error), LAM_OK);
    ck_assert_uint_eq(found, 3);
    ck_assert_double_eq(values[1], -2.5);
    ck_assert_double_eq(values[2], 300);
    ck_assert_int_eq(option_numbers("--x", "4", 3, false, values, &found, &error), LAM_OK);
    ck_assert_uint_eq(found, 1);
    ck_assert_int_eq(option_numbers("--x", "4,5", 3, true, values, &found, &error), LAM_ERR_ARGUMENT);
    values[0] = 7;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        ck_assert_msg(option_numbers("--x", bad[i], 3, false, values, &found, &error) == LAM_ERR_ARGUMENT,
                      "'%s' was read", bad[i]);
        ck_assert_double_eq(values[0], 7);
    }
}
END_TEST

START_TEST(test_words) {
    ck_assert(option_among("b", "a|b|c"));
    ck_assert(option_among("c", "a|b|c"));
    ck_assert(!option_among("", "a|b|c"));
    ck_assert(!option_among("a|b", "a|b|c"));
    ck_assert(!option_among("aa", "a|b|c"));
    ck_assert(!option_among("a", "aa|b"));
    ck_assert(!option_among("a", ""));
}
END_TEST

typedef struct fields {
    bool flag;
    const char *text, *choice, *optional;
    option_list list;
    double number;
    uint64_t count, size;
    double custom;
} fields;

static lam_status parse_custom(const char *text, void *field, lam_error *error) {
    return option_number("--custom", text, field, error);
}

#define FIELD(member) offsetof(fields, member)
static const option_row rows[] = {
    {.name = "output",
     .letter = 'o',
     .kind = OPTION_TEXT,
     .offset = FIELD(text),
     .value = "FILE",
     .doc = "?"},
    {.kind = OPTION_HEADING, .doc = "more"},
    {.name = "flag", .kind = OPTION_FLAG, .offset = FIELD(flag), .doc = "?"},
    {.name = "list", .kind = OPTION_LIST, .offset = FIELD(list), .value = "X", .doc = "?"},
    {.name = "number",
     .kind = OPTION_NUMBER,
     .offset = FIELD(number),
     .value = "X",
     .doc = "?",
     .low = 0,
     .high = 1,
     .low_open = true},
    {.name = "count",
     .kind = OPTION_COUNT_AUTO,
     .offset = FIELD(count),
     .value = "N",
     .doc = "?",
     .low = 2,
     .high = 9},
    {.name = "size", .kind = OPTION_SIZE, .offset = FIELD(size), .value = "SIZE", .doc = "?"},
    {.name = "choice",
     .kind = OPTION_CHOICE,
     .offset = FIELD(choice),
     .value = "X",
     .doc = "?",
     .choices = "one|two",
     .later = "three|four:"},
    {.name = "optional",
     .kind = OPTION_OPTIONAL,
     .offset = FIELD(optional),
     .value = "X",
     .doc = "?",
     .choices = "yes",
     .later = "maybe"},
    {.name = "custom",
     .kind = OPTION_CUSTOM,
     .offset = FIELD(custom),
     .value = "X",
     .doc = "?",
     .parse = parse_custom},
    {.name = "later", .kind = OPTION_LATER, .value = "X", .doc = "?"},
    {0},
};
static const option_verb verb = {.name = "test",
                                 .arguments = "FILE",
                                 .summary = "?",
                                 .options = rows,
                                 .min_arguments = 1,
                                 .max_arguments = 2};

/* Parses up to 9 words with standard error in said. */
static int parse(const char *const *words, fields *f, option_result *result, char said[512]) {
    char copies[10][64], *argv[11];
    int argc = 0, pipes[2], saved = dup(STDERR_FILENO);
    snprintf(copies[argc], sizeof copies[argc], "test");
    argv[argc] = copies[argc];
    for (argc = 1; words[argc - 1] != NULL; argc++) {
        snprintf(copies[argc], sizeof copies[argc], "%s", words[argc - 1]);
        argv[argc] = copies[argc];
    }
    argv[argc] = NULL;
    ck_assert_int_eq(pipe(pipes), 0);
    fflush(stderr);
    dup2(pipes[1], STDERR_FILENO);
    int code = options_parse(&verb, argc, argv, f, result);
    fflush(stderr);
    dup2(saved, STDERR_FILENO);
    close(saved);
    close(pipes[1]);
    ssize_t length = read(pipes[0], said, 511);
    close(pipes[0]);
    said[length < 0 ? 0 : length] = '\0';
    return code;
}

#define WORDS(...)                                                                                           \
    (const char *const[]) {                                                                                  \
        __VA_ARGS__, NULL                                                                                    \
    }

START_TEST(test_table) {
    fields f = {.number = 5};
    option_result result = {0};
    char said[512];
    ck_assert_int_eq(parse(WORDS("a", "-o", "b", "--flag", "--list", "x", "--list=y", "--number=.5", "c"), &f,
                           &result, said),
                     OPTIONS_GO);
    ck_assert_str_eq(said, "");
    ck_assert_uint_eq(result.n_arguments, 2);
    ck_assert_uint_eq(f.list.count, 2);
    ck_assert(f.flag);
    ck_assert_double_eq(f.number, .5);
    ck_assert(options_given(&verb, &result, "output"));
    ck_assert(options_given(&verb, &result, "flag"));
    ck_assert(!options_given(&verb, &result, "size"));
    ck_assert(!options_given(&verb, &result, "nothing"));
    ck_assert_int_eq(parse(WORDS("a", "--count", "auto", "--size", "2K", "--choice", "two", "--optional"), &f,
                           &result, said),
                     OPTIONS_GO);
    ck_assert_uint_eq(f.count, OPTION_AUTO);
    ck_assert_uint_eq(f.size, 2048);
    ck_assert_str_eq(f.optional, "");
    ck_assert_int_eq(parse(WORDS("a", "--optional=yes", "--count=9", "--custom", "3"), &f, &result, said),
                     OPTIONS_GO);
    ck_assert_uint_eq(f.count, 9);
    ck_assert_double_eq(f.custom, 3);
}
END_TEST

START_TEST(test_table_refuses_in_one_line) {
    static const struct {
        const char *words[3];
        const char *wanted;
    } cases[] = {
        {{"--flag"}, "too few arguments"},
        {{"a", "--nope"}, "unrecognized"},
        {{"a", "--number", "0"}, "--number 0: must be above 0 and at most 1"},
        {{"a", "--number", "1.1"}, "at most 1"},
        {{"a", "--count", "1"}, "--count 1: must be at least 2 and at most 9"},
        {{"a", "--count", "10"}, "at most 9"},
        {{"a", "--choice", "five"}, "must be one of: one two"},
        {{"a", "--choice", "three"}, "--choice three is not supported yet"},
        {{"a", "--choice", "four:7"}, "--choice four:7 is not supported yet"},
        {{"a", "--choice", "four"}, "must be one of"},
        {{"a", "--optional=no"}, "no such value"},
        {{"a", "--optional=maybe"}, "not supported yet"},
        {{"a", "--custom", "x"}, "--custom x: not a number"},
        {{"a", "--later", "x"}, "--later is not supported yet"},
        {{"a", "--output="}, "not empty"},
        {{"a", "b", "c"}, "one argument too many"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        fields f = {0};
        option_result result = {0};
        char said[512];
        const char *const words[] = {cases[i].words[0], cases[i].words[1], cases[i].words[2], NULL};
        ck_assert_int_eq(parse(words, &f, &result, said), 2);
        ck_assert_msg(strstr(said, cases[i].wanted) != NULL, "wanted '%s', said '%s'", cases[i].wanted, said);
        ck_assert_msg(strchr(said, '\n') == said + strlen(said) - 1, "not one line: '%s'", said);
        ck_assert_uint_eq(result.n_arguments, 0);
    }
}
END_TEST

int main(void) {
    Suite *s = suite_create("options");
    TCase *c = tcase_create("all");
    tcase_set_timeout(c, 60);
    tcase_add_test(c, test_numbers);
    tcase_add_test(c, test_counts);
    tcase_add_test(c, test_sizes);
    tcase_add_test(c, test_lists_of_numbers);
    tcase_add_test(c, test_words);
    tcase_add_test(c, test_table);
    tcase_add_test(c, test_table_refuses_in_one_line);
    suite_add_tcase(s, c);
    return suite_run(s);
}
