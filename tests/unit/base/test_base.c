/* The bits of random numbers, on which stores depend; growing arrays; bit sets; work areas; spans of time. */
#include "solver/base/array_grow.h"
#include "solver/base/bitset.h"
#include "solver/base/clock.h"
#include "solver/base/random.h"
#include "solver/base/work_area.h"
#include "support/suite.h"

#include <math.h>

static lam_error error;

/* The values of SplitMix64 for the seed 1234567 are those that its authors' program prints. */
START_TEST(random_numbers_keep_their_bits) {
    uint64_t state = 1234567;
    ck_assert(random_next(&state) == 6457827717110365317u);
    ck_assert(random_next(&state) == 3203168211198807973u);
    state = 0;
    ck_assert(random_next(&state) == random_hash(0));
    ck_assert(random_hash(0) == 0xE220A8397B1DCDAFu);
    ck_assert(random_mix(RANDOM_STEP) == random_hash(0));
    ck_assert(random_to_double(random_scatter(RANDOM_STEP)) == 0x1.bda0985aeb8d8p-2);
    state = 1;
    ck_assert(random_lcg(&state) == 7806831264735756412u && state == 7806831264735756412u);
    ck_assert(random_to_double(UINT64_MAX) == 1 - 0x1p-53);
    ck_assert(random_to_float(UINT64_MAX) == 1 - 0x1p-24f);
    ck_assert(random_to_double(0) == 0 && random_to_float(0) == 0);
}
END_TEST

START_TEST(arrays_grow_and_keep_their_content) {
    uint32_t *values = NULL;
    size_t capacity = 0, grown = 0;
    ck_assert(array_grow(&values, &capacity, 0, sizeof *values, "values", &error) == LAM_OK);
    ck_assert_ptr_nonnull(values);
    for (uint32_t i = 0; i < 100000; i++) {
        const size_t before = capacity;
        ck_assert(array_grow(&values, &capacity, i + 1, sizeof *values, "values", &error) == LAM_OK);
        grown += capacity != before;
        values[i] = i;
    }
    for (uint32_t i = 0; i < 100000; i++) ck_assert(values[i] == i);
    ck_assert_uint_le(grown, 20); /* log(1e5 / 64) / log(1.5) = 18.1 */
    const size_t before = capacity;
    const uint32_t *there = values;
    ck_assert(array_grow(&values, &capacity, SIZE_MAX / 2, sizeof *values, "values", &error) ==
              LAM_ERR_MEMORY);
    ck_assert_uint_eq(capacity, before);
    ck_assert(values == there);
    free(values);
}
END_TEST

START_TEST(a_bitset_gives_positions_in_ascending_order_once) {
    static const size_t added[] = {9000, 0, 63, 64, 9000, 4096, 4095, 0};
    static const uint32_t sorted[] = {0, 63, 64, 4095, 4096, 9000};
    bitset b;
    ck_assert(bitset_make(9001, 0, "positions", &b, &error) == LAM_OK);
    for (int turn = 0; turn < 2; turn++) {
        for (size_t k = 0; k < sizeof added / sizeof *added; k++) bitset_add(&b, added[k]);
        ck_assert_uint_eq(bitset_take(&b), 6);
        ck_assert_mem_eq(b.taken, sorted, sizeof sorted);
    }
    ck_assert_uint_eq(bitset_take(&b), 0);
    bitset_free(&b);
}
END_TEST

START_TEST(a_work_area_holds_what_was_added) {
    size_t total = WORK_AREA_ALIGN;
    ck_assert(work_area_add(&total, 1) && work_area_add(&total, 65) && work_area_add(&total, 0));
    ck_assert_uint_eq(total, 4 * WORK_AREA_ALIGN);
    ck_assert(!work_area_add(&total, SIZE_MAX));
    char memory[4 * WORK_AREA_ALIGN];
    for (size_t shift = 0; shift < WORK_AREA_ALIGN; shift++) {
        void *rest = work_area_begin(memory + shift);
        char *one = work_area_take(&rest, 1), *two = work_area_take(&rest, 65);
        ck_assert((uintptr_t)one % WORK_AREA_ALIGN == 0 && one >= memory + shift &&
                  one < memory + shift + WORK_AREA_ALIGN);
        ck_assert(two == one + WORK_AREA_ALIGN && rest == two + 2 * WORK_AREA_ALIGN);
    }
}
END_TEST

START_TEST(spans_of_time_read_well) {
    static const struct {
        double seconds;
        const char *text;
    } spans[] = {{0, "0.0 s"},        {9.94, "9.9 s"},     {9.96, "10 s"},      {59.4, "59 s"},
                 {59.6, "1 min 0 s"}, {200, "3 min 20 s"}, {7500, "2 h 5 min"}, {INFINITY, "27777 h 46 min"}};
    char text[32];
    ck_assert_str_eq((clock_format_seconds(spans[_i].seconds, text), text), spans[_i].text);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("base");
    TCase *tests = tcase_create("base");
    tcase_add_test(tests, random_numbers_keep_their_bits);
    tcase_add_test(tests, arrays_grow_and_keep_their_content);
    tcase_add_test(tests, a_bitset_gives_positions_in_ascending_order_once);
    tcase_add_test(tests, a_work_area_holds_what_was_added);
    tcase_add_loop_test(tests, spans_of_time_read_well, 0, 8);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
