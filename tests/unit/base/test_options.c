/* The readers of numbers and the tables of options. */
#include "solver/base/options/options.h"
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
    } good[] = {{"1", 1},         {"4096", 4096},    {"2K", 2048},
                {"2k", 2048},     {"1.5M", 3 << 19}, {"16G", UINT64_C(1) << 34},
                {"2MB", 2 << 20}, {"2mib", 2 << 20}, {"1T", UINT64_C(1) << 40}};
    static const char *const bad[] = {"",     "K",    "0",   "-1G",    "1E",
                                      "1GBB", "1GBi", "5B",  "1 G",    "G1",
                                      "1e9",  "..",   "nan", "1.2.3K", "99999999999999999999G",
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
    char word[OPTION_WORD_BYTES];
    for (unsigned k = 0; k < 3; k++) {
        option_word(k, "one|two|three", word);
        ck_assert_uint_eq(option_place(word, "one|two|three"), k);
    }
    ck_assert_str_eq(word, "three");
}
END_TEST

/* An enum holds the place of a word; of a switch 0 where it is not given, and 1 without a word. */
START_TEST(words_become_places) {
    lam_error error;
    const option_row word = {.name = "w", .kind = OPTION_WORD, .choices = "a|b|c"},
                     change = {.name = "s", .kind = OPTION_SWITCH, .choices = "no|some"};
    unsigned value = 7;
    ck_ok(option_read(&word, "c", &value, &error));
    ck_assert_uint_eq(value, 2);
    ck_assert_int_eq(option_read(&word, "d", &value, &error), LAM_ERR_ARGUMENT);
    ck_assert_uint_eq(value, 2);
    ck_ok(option_read(&change, NULL, &value, &error));
    ck_assert_uint_eq(value, 1);
    ck_ok(option_read(&change, "some", &value, &error));
    ck_assert_uint_eq(value, 3);
    ck_assert_int_eq(option_read(&change, "other", &value, &error), LAM_ERR_ARGUMENT);
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

typedef struct other_fields {
    double number;
    bool quick;
} other_fields;

static lam_status parse_custom(const char *text, void *field, lam_error *error) {
    return option_number("--custom", text, field, error);
}

#define FIELD(member) offsetof(fields, member)
static const option_row rows[] = {
    {.name = "output",
     .letter = 'o',
     .kind = OPTION_TEXT,
     .offset = FIELD(text),
     .argument = "FILE",
     .help = "?"},
    {0},
};
static const option_row more_rows[] = {
    {.name = "flag", .kind = OPTION_FLAG, .offset = FIELD(flag), .help = "?"},
    {.name = "list",
     .kind = OPTION_LIST,
     .offset = FIELD(list),
     .argument = "X",
     .settled = "the list is fixed",
     .help = "?"},
    {.name = "number",
     .kind = OPTION_NUMBER,
     .offset = FIELD(number),
     .argument = "X",
     .preset = ".25",
     .least = 0,
     .most = 1,
     .above = true,
     .not_with = "choice|size",
     .help = "?"},
    {.name = "count",
     .kind = OPTION_COUNT_AUTO,
     .offset = FIELD(count),
     .argument = "N",
     .preset = "auto",
     .least = 2,
     .most = 9,
     .help = "?"},
    {.name = "size",
     .kind = OPTION_SIZE,
     .offset = FIELD(size),
     .argument = "SIZE",
     .preset = "3K",
     .most = 1 << 20,
     .help = "?"},
    {.name = "choice",
     .kind = OPTION_CHOICE,
     .offset = FIELD(choice),
     .preset = "one",
     .choices = "one|two",
     .help = "?"},
    {.name = "optional", .kind = OPTION_OPTIONAL, .offset = FIELD(optional), .choices = "yes", .help = "?"},
    {.name = "custom",
     .kind = OPTION_CUSTOM,
     .offset = FIELD(custom),
     .argument = "X",
     .preset = "7",
     .parse = parse_custom,
     .help = "?"},
    {0},
};
static const option_row other_rows[] = {
    {.name = "number",
     .kind = OPTION_NUMBER,
     .offset = offsetof(other_fields, number),
     .argument = "X",
     .preset = ".5",
     .help = "?"},
    {.name = "quick", .kind = OPTION_FLAG, .offset = offsetof(other_fields, quick), .help = "?"},
    {0},
};
static const option_gone gone[] = {{"past", "give --number X"}, {"flag=slow", "give --flag alone"}, {0}};
static const option_command command = {.name = "lambert test",
                                       .arguments = "FILE",
                                       .summary = "?",
                                       .least_arguments = 1,
                                       .most_arguments = 2,
                                       .gone = gone};

/* Parses words with standard error in said. */
static int parse_both(const char *const *words, fields *f, other_fields *other, option_result *result,
                      char said[512]) {
    static char copies[10][64];
    static char *argv[11];
    int argc = 0, pipes[2], saved = dup(STDERR_FILENO);
    snprintf(copies[argc], sizeof copies[argc], "test");
    argv[argc] = copies[argc];
    for (argc = 1; words[argc - 1] != NULL; argc++) {
        snprintf(copies[argc], sizeof copies[argc], "%s", words[argc - 1]);
        argv[argc] = copies[argc];
    }
    argv[argc] = NULL;
    const option_table tables[] = {
        {NULL, rows, f}, {"more", more_rows, f}, {"other", other_rows, other}, {0}};
    ck_assert_int_eq(pipe(pipes), 0);
    fflush(stderr);
    dup2(pipes[1], STDERR_FILENO);
    int code = options_parse(&command, tables, argc, argv, result);
    fflush(stderr);
    dup2(saved, STDERR_FILENO);
    close(saved);
    close(pipes[1]);
    ssize_t length = read(pipes[0], said, 511);
    close(pipes[0]);
    said[length < 0 ? 0 : length] = '\0';
    return code;
}

static int parse(const char *const *words, fields *f, option_result *result, char said[512]) {
    other_fields other = {0};
    return parse_both(words, f, &other, result, said);
}

#define WORDS(...)                                                                                           \
    (const char *const[]) {                                                                                  \
        __VA_ARGS__, NULL                                                                                    \
    }

START_TEST(test_presets) {
    fields f = {.text = "mine"};
    other_fields other = {0};
    option_result result = {0};
    char said[512];
    ck_assert_int_eq(parse_both(WORDS("a"), &f, &other, &result, said), OPTIONS_GO);
    ck_assert_str_eq(f.text, "mine");
    ck_assert(!f.flag);
    ck_assert_double_eq(f.number, .25);
    ck_assert_double_eq(other.number, .5);
    ck_assert_uint_eq(f.count, OPTION_AUTO);
    ck_assert_uint_eq(f.size, 3072);
    ck_assert_str_eq(f.choice, "one");
    ck_assert_ptr_null(f.optional);
    ck_assert_double_eq(f.custom, 7);
    ck_assert_uint_eq(result.n_given, 0);
}
END_TEST

START_TEST(test_table) {
    fields f = {0};
    other_fields other = {0};
    option_result result = {0};
    char said[512];
    ck_assert_int_eq(
        parse_both(WORDS("a", "-o", "b", "--flag", "--list", "x", "--list=y", "--number=.5", "c"), &f, &other,
                   &result, said),
        OPTIONS_GO);
    ck_assert_str_eq(said, "");
    ck_assert_uint_eq(result.n_arguments, 2);
    ck_assert_str_eq(result.arguments[0], "a");
    ck_assert_str_eq(result.arguments[1], "c");
    ck_assert_str_eq(f.text, "b");
    ck_assert_uint_eq(f.list.count, 2);
    ck_assert(f.flag);
    ck_assert_double_eq(f.number, .5);
    ck_assert(options_given(&result, "output"));
    ck_assert(options_given(&result, "flag"));
    ck_assert(!options_given(&result, "size"));
    ck_assert(!options_given(&result, "nothing"));
    ck_assert_uint_eq(result.n_given, 4);
    ck_assert_int_eq(parse(WORDS("a", "--count", "auto", "--size", "2K", "--choice", "two", "--optional"), &f,
                           &result, said),
                     OPTIONS_GO);
    ck_assert_uint_eq(f.count, OPTION_AUTO);
    ck_assert_uint_eq(f.size, 2048);
    ck_assert_str_eq(f.optional, "");
    ck_assert_int_eq(parse(WORDS("a", "--optional=yes", "--count=9", "--custom", "-3"), &f, &result, said),
                     OPTIONS_GO);
    ck_assert_str_eq(f.optional, "yes");
    ck_assert_uint_eq(f.count, 9);
    ck_assert_double_eq(f.custom, -3);
}
END_TEST

/* A name may be cut short, options end at --, a single dash is an argument. */
START_TEST(test_words_of_the_command_line) {
    fields f = {0};
    option_result result = {0};
    char said[512];
    ck_assert_int_eq(parse(WORDS("--fl", "--", "--flag", "-"), &f, &result, said), OPTIONS_GO);
    ck_assert(f.flag);
    ck_assert_uint_eq(result.n_arguments, 2);
    ck_assert_str_eq(result.arguments[0], "--flag");
    ck_assert_str_eq(result.arguments[1], "-");
    ck_assert_int_eq(parse(WORDS("-ofile", "a"), &f, &result, said), OPTIONS_GO);
    ck_assert_str_eq(f.text, "file");
}
END_TEST

/* An option that stands in two tables is one option; each table has its own field for it. */
START_TEST(test_a_name_in_two_tables) {
    fields f = {0};
    other_fields other = {0};
    option_result result = {0};
    char said[512];
    ck_assert_int_eq(parse_both(WORDS("a", "--num", ".125"), &f, &other, &result, said), OPTIONS_GO);
    ck_assert_double_eq(f.number, .125);
    ck_assert_double_eq(other.number, .125);
    ck_assert_uint_eq(result.n_given, 1);
}
END_TEST

/* The input settles what --list says. */
START_TEST(settled_options_are_refused) {
    fields f = {0};
    option_result result = {0};
    char said[512];
    const option_table tables[] = {{"more", more_rows, &f}, {0}};
    ck_assert_int_eq(parse(WORDS("a", "--list", "x", "--flag"), &f, &result, said), OPTIONS_GO);
    ck_assert_int_eq(options_refuse_settled(&command, tables, &result, "give another"), 2);
    ck_assert_int_eq(parse(WORDS("a", "--flag"), &f, &result, said), OPTIONS_GO);
    ck_assert_int_eq(options_refuse_settled(&command, tables, &result, "give another"), OPTIONS_GO);
}
END_TEST

START_TEST(test_table_refuses_in_one_line) {
    static const struct {
        const char *words[3];
        const char *wanted;
    } cases[] = {
        {{"--flag"}, "too few arguments"},
        {{"a", "--nope"}, "--nope: no such option"},
        {{"a", "-x"}, "-x: no such option"},
        {{"a", "--past", "1"}, "--past: was removed; give --number X"},
        {{"a", "--past=1"}, "--past: was removed; give --number X"},
        {{"a", "--pas"}, "--pas: no such option"},
        {{"a", "--flag=slow"}, "--flag=slow: was removed; give --flag alone"},
        {{"a", "--c", "2"}, "--c: ambiguous"},
        {{"a", "--flag=1"}, "--flag: takes no value"},
        {{"a", "--number"}, "--number: needs a value"},
        {{"a", "--number", "0"}, "--number 0: must be above 0 and at most 1"},
        {{"a", "--number", "1.1"}, "at most 1"},
        {{"a", "--count", "1"}, "--count 1: must be at least 2 and at most 9"},
        {{"a", "--count", "10"}, "at most 9"},
        {{"a", "--size", "2M"}, "--size 2M: must be at least 0 and at most 1048576"},
        {{"a", "--choice", "five"}, "must be one of: one two"},
        {{"a", "--optional=no"}, "must be one of: yes"},
        {{"a", "--custom", "x"}, "--custom x: not a number"},
        {{"a", "--output="}, "not empty"},
        {{"a", "b", "c"}, "one argument too many"},
        {{"a", "--number=.5", "--size=2K"}, "--number and --size exclude each other: give one of the two"},
        {{"a", "--size=2K", "--number=.5"}, "--number and --size exclude each other: give one of the two"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        fields f = {0};
        option_result result = {0};
        char said[512];
        const char *const words[] = {cases[i].words[0], cases[i].words[1], cases[i].words[2], NULL};
        ck_assert_int_eq(parse(words, &f, &result, said), 2);
        ck_assert_msg(strstr(said, cases[i].wanted) != NULL, "wanted '%s', said '%s'", cases[i].wanted, said);
        ck_assert_msg(strchr(said, '\n') == said + strlen(said) - 1, "not one line: '%s'", said);
        ck_assert_msg(strncmp(said, "lambert test: ", 14) == 0, "%s", said);
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
    tcase_add_test(c, words_become_places);
    tcase_add_test(c, test_presets);
    tcase_add_test(c, test_table);
    tcase_add_test(c, test_words_of_the_command_line);
    tcase_add_test(c, test_a_name_in_two_tables);
    tcase_add_test(c, settled_options_are_refused);
    tcase_add_test(c, test_table_refuses_in_one_line);
    suite_add_tcase(s, c);
    return suite_run(s);
}
