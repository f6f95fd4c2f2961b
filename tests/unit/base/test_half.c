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

int main(void) {
    Suite *suite = suite_create("half");
    TCase *tests = tcase_create("half");
    tcase_add_test(tests, halves_come_back_and_go_to_the_nearest);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
