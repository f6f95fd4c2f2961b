/* The area of openings as a direction sees them, by closed forms. */
#include "solver/direct/opening_cells.h"
#include "support/suite.h"

#include <math.h>

static double area_of(luminaire_shape shape, double x, double y, double z, const double direction[3]) {
    const luminaire_opening opening = {.shape = shape, .size = {x, y, z}, .side = {z, z, z, z}};
    opening_faces faces;
    opening_faces_set(&opening, shape == OPENING_POINT, INFINITY, &faces);
    return opening_projected(&faces, direction);
}

START_TEST(areas) {
    static const double down[3] = {0, 0, -1}, up[3] = {0, 0, 1}, east[3] = {1, 0, 0}, skew[3] = {.6, 0, -.8},
                        diagonal[3] = {.6, .64, -.48};
    /* A flat opening has the same area from both sides, and none from its edge. */
    ck_assert_double_eq_tol(area_of(OPENING_RECTANGLE, 1.2, .3, 0, down), .36, 1e-12);
    ck_assert_double_eq_tol(area_of(OPENING_RECTANGLE, 1.2, .3, 0, up), .36, 1e-12);
    ck_assert_double_eq_tol(area_of(OPENING_RECTANGLE, 1.2, .3, 0, skew), .8 * .36, 1e-12);
    ck_assert_double_eq_tol(area_of(OPENING_RECTANGLE, 1.2, .3, 0, east), 0, 1e-12);
    ck_assert_double_eq_tol(area_of(OPENING_DISC, .6, .6, 0, skew), .8 * M_PI * .09, 1e-12);
    /* Of a body the three faces of it that look there. */
    ck_assert_double_eq_tol(area_of(OPENING_BOX, 1.2, .3, .1, diagonal), .6 * .03 + .64 * .12 + .48 * .36,
                            1e-12);
    ck_assert_double_eq_tol(area_of(OPENING_CYLINDER, .4, .4, .5, skew), .6 * .4 * .5 + .8 * M_PI * .04,
                            1e-12);
    ck_assert_double_eq_tol(area_of(OPENING_SPHERE, .4, .4, .4, diagonal), M_PI * .04, 1e-12);
    /* A point and a line have none. */
    ck_assert_double_eq(area_of(OPENING_POINT, 0, 0, 0, down), 0);
    ck_assert_double_eq(area_of(OPENING_RECTANGLE, 1.5, 0, 0, down), 0);
}
END_TEST

int main(void) {
    Suite *s = suite_create("areas of openings");
    TCase *c = tcase_create("all");
    tcase_add_test(c, areas);
    suite_add_tcase(s, c);
    return suite_run(s);
}
