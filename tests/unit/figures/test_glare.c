/* Guth's index against the table of CIE 117, UGR by hand, and which sources count. */
#include "solver/figures/glare.h"
#include "support/suite.h"

#include <math.h>

static const double ahead[3] = {0, 1, 0}, up[3] = {0, 0, 1};

/* The index of a source at `right` and `high` of the distance along the line of sight. */
static double index_at(double right, double high) {
    const double length = sqrt(right * right + 1 + high * high);
    return glare_position(ahead, up, (double[3]){right / length, 1 / length, high / length});
}

/* CIE 117:1995, table of the position index, T/R = 0: the formula was fitted to it within 4 %. */
START_TEST(index_of_guth) {
    static const double table[][2] = {{0, 1},    {.1, 1.26}, {.2, 1.53}, {.3, 1.90},  {.4, 2.35},  {.5, 2.86},
                                      {.6, 3.5}, {.8, 5},    {1, 7},     {1.2, 9.25}, {1.5, 13.15}};
    for (size_t k = 0; k < sizeof table / sizeof *table; k++)
        ck_assert_double_eq_tol(index_at(0, table[k][0]), table[k][1], .04 * table[k][1]);
    /* To the side a source dazzles more than as far above; left is as right. */
    ck_assert_double_lt(index_at(.5, 0), .6 * index_at(0, .5));
    ck_assert_double_eq_tol(index_at(.5, .2), index_at(-.5, .2), 1e-12);
    /* Below the line of sight: 1 + .8 R and 1 + 1.2 R, at most R = 3. */
    ck_assert_double_eq_tol(index_at(.3, -.4), 1.4, 1e-12);
    ck_assert_double_eq_tol(index_at(.6, -.8), 2.2, 1e-12);
    ck_assert_double_eq_tol(index_at(0, -5), 4.6, 1e-12);
    /* Both laws meet at the sides: 1.466 and 1.462 at 30 degrees. */
    ck_assert_double_eq_tol(index_at(.577, 1e-9), index_at(.577, -1e-9), .01);
    ck_assert_double_eq(glare_position(ahead, up, (double[3]){0, -1, 0}), 0);
    ck_assert_double_eq(glare_position(ahead, up, (double[3]){0, 0, 1}), 0);
    ck_assert_double_eq(glare_position(up, up, (double[3]){.6, 0, .8}), 0);
    /* A view that looks down has its own upper half. */
    const double down[3] = {0, .8, -.6}, towards[3] = {0, 1, 0};
    ck_assert_double_eq_tol(glare_position(down, up, towards), index_at(0, .75), 1e-9);
}
END_TEST

/* 1,000 cd, .1 m^2 at 5 m: L = 10,000 cd/m2, w = .004 sr, L^2 w / p^2 = 400,000 / p^2; over L_b = 40 cd/m2
 * with p = 2: 8 log10(.25 / 40 * 100,000) = 8 log10 625 = 22.367. */
START_TEST(rating_by_hand) {
    const glare_source s = {.intensity = 1000, .area = .1, .distance = 5, .position = 2, .seen = 1};
    ck_assert_int_eq(glare_judge(&s), GLARE_COUNTS);
    ck_assert_double_eq_tol(glare_solid_angle(&s), .004, 1e-12);
    ck_assert_double_eq_tol(glare_weight(&s, 1), 1e5, 1e-6);
    ck_assert_double_eq_tol(glare_rating(glare_weight(&s, 1), 40), 22.367, 1e-3);
    /* Twice the light of all: the sum is 4 times, the background 2 times, UGR 8 log10 2 more. */
    ck_assert_double_eq_tol(glare_rating(glare_weight(&s, 2), 80) - glare_rating(glare_weight(&s, 1), 40),
                            8 * log10(2), 1e-9);
    glare_source half = s;
    half.seen = .5;
    ck_assert_double_eq_tol(glare_weight(&half, 1), .5e5, 1e-6);
    ck_assert_double_eq_tol(glare_simplified(2000), .3084, 1e-12);
}
END_TEST

START_TEST(sources_that_count) {
    const glare_source good = {.intensity = 1, .area = .1, .distance = 5, .position = 2, .seen = 1};
    glare_source s = good;
    s.intensity = 0;
    ck_assert_int_eq(glare_judge(&s), GLARE_NO_LIGHT);
    s = good, s.position = 0;
    ck_assert_int_eq(glare_judge(&s), GLARE_OUTSIDE);
    s = good, s.position = 16;
    ck_assert_int_eq(glare_judge(&s), GLARE_OUTSIDE);
    s = good, s.seen = 0;
    ck_assert_int_eq(glare_judge(&s), GLARE_HIDDEN);
    s.area = 0; /* hidden before all else: it does not forbid */
    ck_assert_int_eq(glare_judge(&s), GLARE_HIDDEN);
    s = good, s.area = 0;
    ck_assert_int_eq(glare_judge(&s), GLARE_NO_OPENING);
    ck_assert(glare_forbids(GLARE_NO_OPENING) && glare_forbids(GLARE_LARGE) && !glare_forbids(GLARE_SMALL));
    s = good, s.area = 25 * 2.9e-4;
    ck_assert_int_eq(glare_judge(&s), GLARE_SMALL);
    s.area = 25 * 3.1e-4;
    ck_assert_int_eq(glare_judge(&s), GLARE_COUNTS);
    s.seen = .5; /* the part that is seen is small */
    ck_assert_int_eq(glare_judge(&s), GLARE_SMALL);
    s = good, s.area = 25 * .101;
    ck_assert_int_eq(glare_judge(&s), GLARE_LARGE);
    s.area = 25 * .099;
    ck_assert_int_eq(glare_judge(&s), GLARE_COUNTS);
}
END_TEST

int main(void) {
    Suite *s = suite_create("glare");
    TCase *c = tcase_create("all");
    tcase_add_test(c, index_of_guth);
    tcase_add_test(c, rating_by_hand);
    tcase_add_test(c, sources_that_count);
    suite_add_tcase(s, c);
    return suite_run(s);
}
