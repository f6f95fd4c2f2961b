/* --time: the recipes and the choice among them. */
#include "solver/precompute/budget.h"

#include "solver/base/random.h"
#include "support/suite.h"

#include <string.h>

/* All recipes, with times that grow with the effort of each kind by some factor a step. */
static size_t make_list(uint64_t seed, budget_recipe list[BUDGET_RECIPES_MOST]) {
    const size_t count = budget_list(true, true, true, 32, list);
    double seconds = 1;
    ck_assert_uint_gt(count, 20);
    ck_assert_uint_le(count, BUDGET_RECIPES_MOST);
    for (size_t k = 0; k < count; k++) {
        if (k == 0 || list[k].kind != list[k - 1].kind) seconds = .1 + random_unit(&seed);
        seconds *= 1 + 2 * random_unit(&seed);
        list[k].seconds = seconds;
    }
    return count;
}

START_TEST(finer_recipes_of_a_kind_have_smaller_errors) {
    budget_recipe list[BUDGET_RECIPES_MOST];
    const size_t count = budget_list(true, true, true, 32, list);
    size_t of_kind[3] = {0};
    for (size_t k = 0; k < count; k++) {
        of_kind[list[k].kind]++;
        ck_assert_double_gt(list[k].error, 0);
        ck_assert_double_lt(list[k].seconds, 0);
        if (k > 0 && list[k].kind == list[k - 1].kind && list[k].quality == list[k - 1].quality)
            ck_assert_double_lt(list[k].error, list[k - 1].error);
    }
    for (int kind = 0; kind < 3; kind++) {
        const size_t only =
            budget_list(kind == BUDGET_BLOCKS, kind == BUDGET_RAYS, kind == BUDGET_PAIRS, 32, list);
        ck_assert_uint_eq(only, of_kind[kind]);
        for (size_t k = 0; k < only; k++) ck_assert_int_eq((int)list[k].kind, kind);
    }
}
END_TEST

/* More time never has a larger error, and what is taken fits. */
START_TEST(the_choice_is_monotone) {
    budget_recipe list[BUDGET_RECIPES_MOST];
    for (uint64_t seed = 1; seed <= 50; seed++) {
        const size_t count = make_list(seed, list), cheapest = budget_cheapest(list, count);
        double error = 1e9;
        size_t changes = 0;
        ck_assert_uint_lt(cheapest, count);
        ck_assert_uint_eq(budget_pick(list, count, .999 * list[cheapest].seconds), count);
        for (double seconds = list[cheapest].seconds; seconds < 1e9; seconds *= 1.05) {
            const size_t k = budget_pick(list, count, seconds);
            ck_assert_uint_lt(k, count);
            ck_assert_double_le(list[k].seconds, seconds);
            ck_assert_double_le(list[k].error, error);
            changes += list[k].error < error;
            error = list[k].error;
            for (size_t other = 0; other < count; other++)
                ck_assert(list[other].seconds > seconds || list[other].error >= error);
        }
        ck_assert_uint_gt(changes, 3);
    }
}
END_TEST

/* Recipes that memory has no room for are never taken; of equal errors the one with more probes is. */
START_TEST(only_what_is_known_is_taken) {
    budget_recipe list[3] = {{.error = .01, .probes = 8, .seconds = -1},
                             {.error = .02, .probes = 8, .seconds = 2},
                             {.error = .02, .probes = 32, .seconds = 3}};
    ck_assert_uint_eq(budget_cheapest(list, 3), 1);
    ck_assert_uint_eq(budget_pick(list, 3, 1e9), 2);
    ck_assert_uint_eq(budget_pick(list, 3, 2.5), 1);
    ck_assert_uint_eq(budget_pick(list, 3, 1), 3);
    ck_assert_uint_eq(budget_cheapest(list, 1), 1);
    ck_assert_uint_eq(budget_pick(list, 0, 1), 0);
}
END_TEST

START_TEST(options_name_the_recipe) {
    budget_recipe list[BUDGET_RECIPES_MOST];
    char text[BUDGET_TEXT];
    const size_t count = budget_list(true, true, true, 32, list);
    budget_options(&list[0], "hierarchical", true, text);
    ck_assert_str_eq(text,
                     "--form-factors blocks --method hierarchical --epsilon 0.8 --trials 1 --probes 32");
    budget_options(&list[count - 1], "hierarchical", false, text);
    ck_assert_str_eq(text,
                     "--form-factors rays --quality high --method hierarchical --epsilon 0.003 --trials 1");
    for (size_t k = 0; k < count; k++) {
        char other[BUDGET_TEXT];
        budget_options(&list[k], "hierarchical", true, text);
        for (size_t i = 0; i < k; i++) {
            budget_options(&list[i], "hierarchical", true, other);
            ck_assert_str_ne(text, other);
        }
        if (list[k].kind == BUDGET_RAYS) ck_assert_ptr_nonnull(strstr(text, "--rays "));
    }
}
END_TEST

int main(void) {
    Suite *suite = suite_create("budget");
    TCase *cases = tcase_create("budget");
    tcase_add_test(cases, finer_recipes_of_a_kind_have_smaller_errors);
    tcase_add_test(cases, the_choice_is_monotone);
    tcase_add_test(cases, only_what_is_known_is_taken);
    tcase_add_test(cases, options_name_the_recipe);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
