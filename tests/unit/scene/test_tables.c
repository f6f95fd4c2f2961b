/* Points at one place. */
#include "solver/scene/tables.h"
#include "support/suite.h"

static lam_error error;

START_TEST(welded_points_have_the_first_at_their_place) {
    static const double points[][3] = {{1, 2, 3},      {0, 0, 0},  {1, 2, 3 + 1e-15}, {-0., 0, -0.},
                                       {1, 2, 3},      {3, 2, 1},  {0, 0, 1e-300},    {1, 2, 3 + 1e-15},
                                       {0, 0, 1e-300}, {0, -0., 0}};
    static const uint32_t expected[] = {0, 1, 2, 1, 0, 5, 6, 2, 6, 1};
    enum { COUNT = sizeof points / sizeof *points };
    uint32_t place[COUNT];
    ck_ok(points_weld(COUNT, points, place, &error));
    for (size_t k = 0; k < COUNT; k++) ck_assert_uint_eq(place[k], expected[k]);
    ck_ok(points_weld(0, points, place, &error));
}
END_TEST

int main(void) {
    Suite *suite = suite_create("tables");
    TCase *tests = tcase_create("tables");
    tcase_add_test(tests, welded_points_have_the_first_at_their_place);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
