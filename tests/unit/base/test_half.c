/* Numbers of 16 bits: every one comes back, and every tie goes to the even one. */
#include "solver/base/half.h"
#include "support/suite.h"

#include <math.h>

START_TEST(halves_come_back_and_go_to_the_nearest) {
    for (uint32_t half = 0; half < 0x7c00; half++) {
        const float x = float_of_half((uint16_t)half);
        ck_assert_uint_eq(half_of_float(x), half);
        ck_assert_uint_eq(half_of_float(-x), half | 0x8000);
        const int exponent = (int)(half >> 10);
        const double exact =
            exponent == 0 ? ldexp(half & 1023, -24) : ldexp((double)(1024 + (half & 1023)), exponent - 25);
        ck_assert_double_eq((double)x, exact);
        /* Between it and the next: the tie goes to the even one. */
        if (half + 1 < 0x7c00) {
            const float middle = (x + float_of_half((uint16_t)(half + 1))) / 2;
            ck_assert_uint_eq(half_of_float(middle), half + (half & 1));
            ck_assert_uint_eq(half_of_float(nextafterf(middle, INFINITY)), half + 1);
        }
    }
    ck_assert(isinf(float_of_half(0x7c00)) && isnan(float_of_half(0x7e00)) && half_of_float(65520) == 0x7c00);
}
END_TEST

/* Many at once, of any bits, also in the place of the floats: as one by one. */
START_TEST(halves_of_many) {
    enum { MANY = 4099 };
    static float x[MANY];
    static uint16_t halves[MANY];
    static float over[MANY];
    uint32_t bits = 1;
    for (size_t i = 0; i < MANY; i++) {
        bits = bits * 1664525u + 1013904223u;
        /* Half of them near the range of f16, the others anywhere. */
        x[i] = float_of_bits(i % 2 == 0 ? bits : (bits & 0x8FFFFFFFu) | 0x30000000u);
    }
    for (size_t count = 0; count <= MANY; count = count < 40 ? count + 1 : count + 4059) {
        memset(halves, 0x55, sizeof halves);
        halves_of_floats(x, count, halves);
        memcpy(over, x, sizeof x);
        halves_of_floats(over, count, over);
        for (size_t i = 0; i < count; i++) {
            const uint16_t one = half_of_float(x[i]);
            if (isnan(x[i]))
                ck_assert(isnan(float_of_half(halves[i])));
            else
                ck_assert_uint_eq(halves[i], one);
            uint16_t there;
            memcpy(&there, (const char *)over + 2 * i, sizeof there);
            ck_assert_uint_eq(there, halves[i]);
        }
        if (count < MANY) ck_assert_uint_eq(halves[count], 0x5555);
    }
}
END_TEST

int main(void) {
    Suite *suite = suite_create("half");
    TCase *tests = tcase_create("half");
    tcase_add_test(tests, halves_come_back_and_go_to_the_nearest);
    tcase_add_test(tests, halves_of_many);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
