/* Figures of sets of points, by hand. */
#include "solver/figures/point_figures.h"
#include "support/suite.h"

#include <math.h>

START_TEST(figures_of_points) {
    const double x[] = {400, NAN, 300, 500, 200};
    const point_figures f = point_figures_of(5, x);
    ck_assert_uint_eq(f.n, 4);
    ck_assert_double_eq_tol(f.mean, 350, 1e-12);
    ck_assert_double_eq(f.min, 200);
    ck_assert_double_eq(f.max, 500);
    ck_assert_double_eq_tol(f.uniformity, 200. / 350, 1e-12);
    ck_assert_double_eq(point_share(5, x, 300), .75); /* 300 itself counts */
    ck_assert_double_eq(point_share(5, x, 300.1), .5);
    ck_assert_double_eq(point_share(5, x, 501), 0);
    const point_figures none = point_figures_of(1, x + 1);
    ck_assert(none.n == 0 && isnan(none.mean) && isnan(none.min) && isnan(none.max) &&
              isnan(none.uniformity));
    ck_assert(isnan(point_share(1, x + 1, 0)));
    ck_assert(isnan(point_figures_of(2, (double[2]){0, 0}).uniformity));
}
END_TEST

START_TEST(ratios_of_points) {
    double x[] = {100, 50, NAN, 10};
    const double y[] = {200, 0, 5, NAN};
    point_ratios(4, x, y, x);
    ck_assert_double_eq(x[0], .5);
    for (int k = 1; k < 4; k++) ck_assert(isnan(x[k]));
}
END_TEST

START_TEST(places_of_points) {
    const double at[3] = {1, 2, 3}, near[3] = {1, 2.0009, 3}, far[3] = {1, 2.0011, 3}, up[3] = {0, 0, 1},
                 down[3] = {0, 0, -1};
    ck_assert(point_is_at((faced_point){at, up}, (faced_point){near, up}));
    ck_assert(!point_is_at((faced_point){at, up}, (faced_point){far, up}));
    ck_assert(!point_is_at((faced_point){at, up}, (faced_point){at, down}));
}
END_TEST

int main(void) {
    Suite *s = suite_create("figures of points");
    TCase *c = tcase_create("all");
    tcase_add_test(c, figures_of_points);
    tcase_add_test(c, ratios_of_points);
    tcase_add_test(c, places_of_points);
    suite_add_tcase(s, c);
    return suite_run(s);
}
