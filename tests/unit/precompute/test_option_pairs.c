/* The options that rows of precompute exclude are options of precompute. */
#include "solver/precompute/precompute.h"
#include "support/suite.h"

#include <string.h>

static bool has_option(const precompute_tables *t, const char *name, size_t length) {
    for (size_t k = 0; k < t->n_tables; k++)
        for (const option_row *row = t->tables[k].rows; row->name != NULL; row++)
            if (strlen(row->name) == length && strncmp(row->name, name, length) == 0) return true;
    return false;
}

START_TEST(excluded_options_exist) {
    precompute_options options;
    precompute_tables tables;
    size_t pairs = 0;
    precompute_tables_make(&options, false, &tables);
    for (size_t k = 0; k < tables.n_tables; k++)
        for (const option_row *row = tables.tables[k].rows; row->name != NULL; row++)
            for (const char *word = row->not_with; word != NULL && *word != '\0'; pairs++) {
                const size_t length = strcspn(word, "|");
                ck_assert_msg(has_option(&tables, word, length), "--%s excludes --%.*s, which is no option",
                              row->name, (int)length, word);
                word += length + (word[length] == '|');
            }
    ck_assert_uint_gt(pairs, 20);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("option pairs");
    TCase *cases = tcase_create("option pairs");
    tcase_add_test(cases, excluded_options_exist);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
