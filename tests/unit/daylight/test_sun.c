/* The position of the sun against published values and almanacs. */
#include "solver/daylight/sun.h"
#include "support/suite.h"

#include <math.h>

#define DEGREE (M_PI / 180)

static double turned(double azimuth) {
    return azimuth < 0 ? azimuth / DEGREE + 360 : azimuth / DEGREE;
}

/* The example of Reda and Andreas, "Solar Position Algorithm for Solar Radiation Applications", NREL/TP-560-
 * 34302 (2008), table A5.1: topocentric, zenith 50.11162 with refraction, of which its altitude without is
 * 39.872046. The parallax it has, .002, and the .01 of the formulas are the tolerance. */
START_TEST(nrel_example) {
    const sun_position s = sun_at(39.742476, -105.1786, -7, 2003, 10, 17, 12 + 30 / 60. + 30 / 3600.);
    ck_assert_double_eq_tol(s.altitude / DEGREE, 39.872046, .012);
    ck_assert_double_eq_tol(90 - s.altitude / DEGREE, 50.11162, .03);
    ck_assert_double_eq_tol(turned(s.azimuth), 194.34024, .02);
    ck_assert_double_eq_tol(s.distance, .9965422974, 1e-4);
}
END_TEST

/* Seen from the pole the altitude is the declination. The instants are those of the Astronomical
 * Applications Department of the US Naval Observatory, UT. Near an equinox it moves .4 degrees a day. */
START_TEST(declination) {
    static const struct {
        int year, month, day;
        double hour, declination;
    } known[] = {{2000, 3, 20, 7 + 35 / 60., 0},       {2000, 6, 21, 1 + 48 / 60., 23.44},
                 {2000, 9, 22, 17 + 28 / 60., 0},      {2000, 12, 21, 13 + 37 / 60., -23.44},
                 {2020, 3, 20, 3 + 50 / 60., 0},       {2020, 6, 20, 21 + 44 / 60., 23.436},
                 {2020, 12, 21, 10 + 2 / 60., -23.436}};
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        const sun_position north =
            sun_at(90, 0, 0, known[i].year, known[i].month, known[i].day, known[i].hour);
        const sun_position south =
            sun_at(-90, 0, 0, known[i].year, known[i].month, known[i].day, known[i].hour);
        ck_assert_double_eq_tol(north.altitude / DEGREE, known[i].declination, .011);
        ck_assert_double_eq_tol(south.altitude, -north.altitude, 1e-12);
    }
}
END_TEST

/* Where the sun crosses the meridian, in minutes after 12 of local mean time at Greenwich. */
static double equation_of_time(int month, int day) {
    double low = 11, high = 13;
    for (int k = 0; k < 50; k++) {
        const double middle = .5 * (low + high);
        const sun_position s = sun_at(51.48, 0, 0, 2001, month, day, middle);
        *(s.direction[0] > 0 ? &low : &high) = middle;
    }
    return (12 - low) * 60;
}

START_TEST(extremes_of_the_equation_of_time) {
    /* Minutes; .01 degrees of position are .04 minutes, and years differ by about .1. */
    ck_assert_double_eq_tol(equation_of_time(2, 11), -14.24, .15);
    ck_assert_double_eq_tol(equation_of_time(5, 14), 3.66, .15);
    ck_assert_double_eq_tol(equation_of_time(7, 26), -6.54, .15);
    ck_assert_double_eq_tol(equation_of_time(11, 3), 16.43, .15);
    ck_assert_double_eq_tol(equation_of_time(4, 15), 0, .3);
}
END_TEST

START_TEST(directions) {
    /* East in the morning, south at noon, west in the evening; in the southern hemisphere north at noon. */
    ck_assert_double_gt(sun_at(48, 15, 1, 2001, 3, 20, 8).direction[0], .5);
    ck_assert_double_eq_tol(turned(sun_at(48, 15, 1, 2001, 3, 20, 6.2).azimuth), 91, 1.5);
    ck_assert_double_lt(sun_at(48, 15, 1, 2001, 3, 20, 12).direction[1], -.5);
    ck_assert_double_lt(sun_at(48, 15, 1, 2001, 3, 20, 17).direction[0], -.5);
    ck_assert_double_gt(sun_at(-48, 15, 1, 2001, 3, 20, 12).direction[1], .5);
    ck_assert_double_lt(sun_at(48, 15, 1, 2001, 3, 20, 0).altitude, -.5);
    /* Noon altitude is 90 - latitude + declination. */
    const double noon = 12 - equation_of_time(6, 21) / 60;
    ck_assert_double_eq_tol(sun_at(51.48, 0, 0, 2001, 6, 21, noon).altitude / DEGREE, 90 - 51.48 + 23.439,
                            .012);
    /* The clock of another zone, and midnight as hour 24 or hour 0 of the next day, say the same instant. */
    const sun_position a = sun_at(37.72, -122.22, -8, 2000, 2, 29, 24);
    const sun_position b = sun_at(37.72, -122.22, 1, 2000, 3, 1, 9);
    const sun_position c = sun_at(37.72, -122.22, -8, 2000, 3, 1, 0);
    for (int d = 0; d < 3; d++) {
        ck_assert_double_eq_tol(a.direction[d], b.direction[d], 1e-9);
        ck_assert_double_eq_tol(a.direction[d], c.direction[d], 1e-9);
    }
}
END_TEST

/* At every hour of some years: one unit vector, its angles, and a position that moves 15 degrees an hour. */
START_TEST(consistent) {
    const double latitude = -40 + 40 * _i;
    static const int days[12] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
    sun_position before = sun_at(latitude, 30, 2, 2002, 1, 1, 0);
    for (int month = 1; month <= 12; month++)
        for (int day = 1; day <= days[month - 1]; day++)
            for (int hour = 1; hour <= 24; hour++) {
                const sun_position s = sun_at(latitude, 30, 2, 2002, month, day, hour);
                double dot = 0;
                for (int d = 0; d < 3; d++) dot += s.direction[d] * before.direction[d];
                ck_assert(fabs(sin(s.altitude) - s.direction[2]) < 1e-12);
                ck_assert(fabs(cos(s.altitude) * sin(s.azimuth) - s.direction[0]) < 1e-12);
                ck_assert(fabs(cos(s.altitude) * cos(s.azimuth) - s.direction[1]) < 1e-12);
                ck_assert(dot > cos(15.1 * DEGREE) && dot < cos(15 * cos(23.5 * DEGREE) * DEGREE - .002));
                ck_assert(s.distance > .983 && s.distance < 1.017);
                before = s;
            }
}
END_TEST

int main(void) {
    Suite *s = suite_create("sun");
    TCase *c = tcase_create("all");
    tcase_set_timeout(c, 60);
    tcase_add_test(c, nrel_example);
    tcase_add_test(c, declination);
    tcase_add_test(c, extremes_of_the_equation_of_time);
    tcase_add_test(c, directions);
    tcase_add_loop_test(c, consistent, 0, 3);
    suite_add_tcase(s, c);
    return suite_run(s);
}
