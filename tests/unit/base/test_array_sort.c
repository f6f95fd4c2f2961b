/* Sorting by several threads beside qsort, whatever the number of items and threads. */
#include "solver/base/array_sort.h"
#include "solver/base/random.h"
#include "support/suite.h"

#include <omp.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Items have an odd size and few different keys; the number tells equal keys apart. */
typedef struct item {
    uint16_t key, number[2];
} item;

static int by_key(const void *left, const void *right) {
    const item *a = left, *b = right;
    if (a->key != b->key) return a->key < b->key ? -1 : 1;
    return memcmp(a->number, b->number, sizeof a->number);
}

static const size_t counts[] = {0, 1, 2, 8191, 8192, 8193, 30011};
enum { COUNTS = sizeof counts / sizeof *counts, MOST = 30011 };

START_TEST(it_is_qsort_for_any_number_of_threads) {
    static item given[MOST], expected[MOST], found[MOST];
    const size_t count = counts[_i];
    uint64_t seed = 7;
    for (size_t k = 0; k < count; k++) {
        const uint32_t number = (uint32_t)k;
        given[k].key = (uint16_t)(random_unit(&seed) * 100);
        memcpy(given[k].number, &number, sizeof number);
    }
    memcpy(expected, given, count * sizeof *given);
    if (count > 0) qsort(expected, count, sizeof *expected, by_key);
    const int most = omp_get_max_threads();
    for (int threads = 1; threads <= 9; threads++) {
        omp_set_num_threads(threads);
        memcpy(found, given, count * sizeof *given);
        array_sort(found, count, sizeof *found, by_key);
        ck_assert_int_eq(memcmp(found, expected, count * sizeof *found), 0);
    }
    omp_set_num_threads(most);
}
END_TEST

START_TEST(it_sorts_within_a_parallel_region) {
    enum { AT_ONCE = 3, COUNT = 9000 };
    static uint32_t of[AT_ONCE][COUNT];
    uint64_t seed = 9;
    for (size_t k = 0; k < AT_ONCE * COUNT; k++)
        of[k / COUNT][k % COUNT] = (uint32_t)(random_unit(&seed) * 1e9);
#pragma omp parallel for num_threads(AT_ONCE)
    for (size_t t = 0; t < AT_ONCE; t++) {
        item *const as_items = malloc(COUNT * sizeof *as_items);
        for (size_t k = 0; as_items != NULL && k < COUNT; k++)
            as_items[k] = (item){(uint16_t)(of[t][k] >> 16), {(uint16_t)of[t][k], 0}};
        if (as_items != NULL) array_sort(as_items, COUNT, sizeof *as_items, by_key);
        for (size_t k = 0; k < COUNT; k++) of[t][k] = as_items != NULL ? as_items[k].key : 0;
        free(as_items);
    }
    for (size_t t = 0; t < AT_ONCE; t++) {
        ck_assert_uint_gt(of[t][COUNT - 1], of[t][0]);
        for (size_t k = 1; k < COUNT; k++) ck_assert_uint_le(of[t][k - 1], of[t][k]);
    }
}
END_TEST

int main(void) {
    Suite *suite = suite_create("array sort");
    TCase *tests = tcase_create("array sort");
    tcase_add_loop_test(tests, it_is_qsort_for_any_number_of_threads, 0, COUNTS);
    tcase_add_test(tests, it_sorts_within_a_parallel_region);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
