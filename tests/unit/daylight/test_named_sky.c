/* Skies by name: their light on a horizontal plane, their shapes, the suns, and moments of a year. */
#include "solver/daylight/moment.h"
#include "solver/daylight/named_sky.h"
#include "support/suite.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static sky_tiling tiles_of(const char *name) {
    sky_tiling s = {0};
    lam_error error = {0};
    ck_assert_msg(sky_tiling_create(name, 'z', &s, &error) == LAM_OK, "%s", error.message);
    return s;
}

static named_sky parsed(const char *text) {
    named_sky k = {0};
    lam_error error = {0};
    ck_assert(named_sky_is(text));
    ck_assert_msg(named_sky_parse("--sky", text, &k, &error) == LAM_OK, "%s", error.message);
    return k;
}

static double received(const sky_tiling *s, const double *L) {
    double sum = 0;
    for (size_t t = 0; t < s->n_tiles; t++) sum += L[t] * s->tiles[t].cosine;
    return sum;
}

START_TEST(words) {
    static const char *const wrong[] = {
        "cloudy",       "Overcast",     "turbidity",     "turbidity:",    "turbidity:.5",
        "turbidity:21", "turbidity:4x", "turbidity:nan", "turbidity:1e1", "overcast:2"};
    named_sky k = {.turbidity = 77};
    lam_error error = {0};
    ck_assert_double_eq(parsed("turbidity:4.5").turbidity, 4.5);
    ck_assert_int_eq(parsed("overcast").model, SKY_OVERCAST);
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        ck_assert_int_eq(named_sky_parse("--sky", wrong[i], &k, &error), LAM_ERR_ARGUMENT);
        ck_assert_ptr_nonnull(strstr(error.message, wrong[i]));
        ck_assert_double_eq(k.turbidity, 77);
    }
    ck_assert(!named_sky_is("sky.npy") && !named_sky_is("year/sky") && !named_sky_is("sky-1") &&
              !named_sky_is(""));
}
END_TEST

/* Each sky gives a horizontal plane the light that is stated, on any tiles; the zenith of the overcast sky is
 * three times its horizon, as means of tiles near to each. */
START_TEST(light) {
    static const char *const names[] = {"even", "overcast", "clear", "turbidity:2", "turbidity:6"};
    static const char *const tilings[] = {"tregenza", "reinhart:3", "grid:7x5", "grid:1x1"};
    const sun_position at = sun_of_angles(130, 40);
    lam_error error = {0};
    for (size_t n = 0; n < sizeof tilings / sizeof tilings[0]; n++) {
        sky_tiling s = tiles_of(tilings[n]);
        double *L = calloc(s.n_tiles, sizeof *L);
        for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
            for (int in_tiles = 0; in_tiles < 2; in_tiles++)
                for (int asked = 0; asked < 3; asked++) {
                    named_sky k = parsed(names[i]);
                    year_sun sun;
                    sky_horizontal of;
                    k.lux_outside = asked == 1 ? 12345 : 0;
                    k.photometric = asked == 2;
                    ck_assert_int_eq(named_sky_make(&k, &at, &s, in_tiles, L, &sun, &of, &error), LAM_OK);
                    const double all = of.diffuse + of.direct;
                    ck_assert_double_eq_tol(received(&s, L), of.diffuse + (in_tiles ? of.direct : 0),
                                            1e-9 * all);
                    ck_assert_double_eq_tol(sun.normal * sin(40 * M_PI / 180), of.direct, 1e-9 * all);
                    ck_assert((of.direct > 0) == (i >= 2));
                    if (asked == 1) ck_assert_double_eq_tol(all, 12345, 1e-9 * all);
                    if (asked != 1 && i < 2) ck_assert_double_eq_tol(all, SKY_LUX_OUTSIDE, 1e-6);
                    /* A clear noon: 500 to 700 W/m2 at 40 degrees, at about 110 lm/W. */
                    if (asked == 0 && i >= 2) ck_assert(all > 350 && all < 750);
                    if (asked == 2 && i >= 2) ck_assert(all > 4e4 && all < 8e4);
                }
        free(L);
        sky_tiling_free(&s);
    }
    sky_tiling s = tiles_of("grid:1x90");
    double L[90];
    year_sun sun;
    sky_horizontal of;
    const named_sky overcast = parsed("overcast");
    ck_assert_int_eq(named_sky_make(&overcast, NULL, &s, false, L, &sun, &of, &error), LAM_OK);
    ck_assert_double_eq_tol(L[89] / L[0], 3, .06);
    ck_assert_double_eq_tol(L[89], 10000 * 9 / (7 * M_PI), 2); /* E = 7 pi L / 9 of the zenith's L */
    sky_tiling_free(&s);
}
END_TEST

/* The CIE clear sky by its formula at the places of fine tiles, over that of the zenith. */
START_TEST(clear_shape) {
    sky_tiling s = tiles_of("reinhart:16");
    double *L = calloc(s.n_tiles, sizeof *L);
    lam_error error = {0};
    year_sun sun;
    sky_horizontal of;
    const named_sky k = parsed("clear");
    const sun_position at = sun_of_angles(-70, 50);
    ck_assert_int_eq(named_sky_make(&k, &at, &s, false, L, &sun, &of, &error), LAM_OK);
    const double Z = M_PI / 2 - at.altitude;
    const double zenith =
        (1 - exp(-.32)) * (1 + 10 * (exp(-3 * Z) - exp(-1.5 * M_PI)) + .45 * cos(Z) * cos(Z));
    for (size_t t = 0; t < s.n_tiles; t += 37) {
        const double *c = s.tiles[t].centre;
        const double gamma = acos(c[0] * at.direction[0] + c[1] * at.direction[1] + c[2] * at.direction[2]);
        const double right = (1 - exp(-.32 / c[2])) *
                             (1 + 10 * (exp(-3 * gamma) - exp(-1.5 * M_PI)) + .45 * cos(gamma) * cos(gamma)) /
                             zenith;
        /* Tiles of less than a degree: the slope is at most 3 a radian. */
        ck_assert_double_eq_tol(L[t] / L[s.n_tiles - 1], right, .04 * right);
    }
    free(L);
    sky_tiling_free(&s);
}
END_TEST

/* Published values of the atlas: a sun in the zenith and air mass 2, T = 3 (Rigollier et al. 2000, eq. 4, 8
 * and 22): direct exp(-.8662 T m delta), diffuse 1367 (-.015843 + .030543 T + .0003797 T^2) F. */
START_TEST(turbid_values) {
    sky_tiling s = tiles_of("tregenza");
    double L[145];
    lam_error error = {0};
    year_sun sun;
    sky_horizontal of;
    const named_sky k = parsed("turbidity:3");
    const sun_position zenith = sun_of_angles(0, 90), low = sun_of_angles(180, 30);
    ck_assert_int_eq(named_sky_make(&k, &zenith, &s, false, L, &sun, &of, &error), LAM_OK);
    ck_assert_double_eq_tol(of.direct, 1367 * exp(-.8662 * 3 / 8.2675), 1);
    ck_assert_int_eq(named_sky_make(&k, &low, &s, false, L, &sun, &of, &error), LAM_OK);
    ck_assert_double_eq_tol(sun.normal, 1367 * exp(-.8662 * 3 * 1.994 / 9.706), 6);
    sky_tiling_free(&s);
}
END_TEST

START_TEST(dark_and_given) {
    sky_tiling s = tiles_of("tregenza");
    double L[145];
    lam_error error = {0};
    year_sun sun;
    sky_horizontal of;
    const sun_position night = sun_of_angles(0, -12), day = sun_of_angles(90, 30);
    const named_sky clear = parsed("clear");
    ck_assert_int_eq(named_sky_make(&clear, &night, &s, true, L, &sun, &of, &error), LAM_ERR_ARGUMENT);
    ck_assert_str_eq(error.message, "the sky is dark: the sun is 12.0 degrees below the horizon");
    named_sky given = {.model = SKY_GIVEN, .direct = 800, .diffuse = 100, .dew_point = NAN};
    ck_assert_int_eq(named_sky_make(&given, &day, &s, true, L, &sun, &of, &error), LAM_OK);
    ck_assert_double_eq_tol(of.direct, 400, 1e-9);
    ck_assert_double_eq_tol(of.diffuse, 100, 1e-9);
    ck_assert_double_eq_tol(received(&s, L), 500, 1e-6);
    given.diffuse = 0;
    ck_assert_int_eq(named_sky_make(&given, &night, &s, true, L, &sun, &of, &error), LAM_ERR_ARGUMENT);
    given.diffuse = 3; /* twilight */
    ck_assert_int_eq(named_sky_make(&given, &night, &s, true, L, &sun, &of, &error), LAM_OK);
    ck_assert_double_eq_tol(received(&s, L), 3, 1e-9);
    sky_tiling_free(&s);
}
END_TEST

/* North at 90 is +x: the sun of the south then stands over -x. */
START_TEST(turned) {
    for (double north = -400; north <= 400; north += 40) {
        const sun_position s = sun_turned(sun_of_angles(200, 25), north),
                           right = sun_of_angles(200 + north, 25);
        for (int d = 0; d < 3; d++) ck_assert_double_eq_tol(s.direction[d], right.direction[d], 1e-12);
        ck_assert_double_eq_tol(cos(s.azimuth - right.azimuth), 1, 1e-12);
        ck_assert(fabs(s.azimuth) <= M_PI + 1e-12);
    }
    const sun_position s = sun_turned(sun_of_angles(180, 0), 90);
    ck_assert_double_eq_tol(s.direction[0], -1, 1e-12);
}
END_TEST

START_TEST(moments) {
    static const char *const wrong[] = {"",
                                        "21",
                                        "21 Mar",
                                        "Mar 21 12:00",
                                        "30 Feb 12:00",
                                        "0 Jan 1:00",
                                        "21 Mar 24:00",
                                        "21 Mar 12:60",
                                        "21 Ma 12:00",
                                        "21 Mars 12:00",
                                        "21 Mar 12:00 x",
                                        "21 Mar -1:00"};
    moment m = {.day = 77};
    lam_error error = {0};
    char name[MOMENT_BYTES];
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        ck_assert_int_eq(moment_parse("--date", wrong[i], &m, &error), LAM_ERR_ARGUMENT);
        ck_assert_int_eq(m.day, 77);
    }
    ck_assert_int_eq(moment_parse("--date", "29 february 9:05", &m, &error), LAM_OK);
    moment_name(&m, name);
    ck_assert_str_eq(name, "29 Feb 09:05");
    m = moment_of_hour(4380);
    moment_name(&m, name);
    ck_assert_str_eq(name, "2 Jul 12:00");
    m = moment_of_hour(8759.5);
    moment_name(&m, name);
    ck_assert_str_eq(name, "31 Dec 23:30");
    weather_hour hours[48];
    weather w = {.n = 48, .step = .5, .hours = hours};
    for (int i = 0; i < 48; i++) hours[i] = (weather_hour){.month = 6, .day = 21, .hour = .25 + .5 * i};
    ck_assert_int_eq(moment_parse("--date", "21 Jun 12:30", &m, &error), LAM_OK);
    ck_assert_int_eq(moment_pick(&m, "a.wea", &w, &error), LAM_OK);
    ck_assert_uint_eq(w.n, 1);
    ck_assert_double_eq(w.hours[0].hour, 12.75);
    ck_assert_int_eq(moment_parse("--date", "22 Jun 12:30", &m, &error), LAM_OK);
    ck_assert_int_eq(moment_pick(&m, "a.wea", &w, &error), LAM_ERR_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(error.message, "a.wea: no row covers 22 Jun 12:30"));
}
END_TEST

/* The sun over tiles near it gives a horizontal plane the same light, nearest tiles are brightest, tiles
 * beyond a tile and a half have none, and a sun that moves changes no tile by more than its way. */
START_TEST(spread) {
    static const char *const tilings[] = {"tregenza", "reinhart:4", "grid:7x5", "grid:1x1", "grid:360x3"};
    for (size_t n = 0; n < sizeof tilings / sizeof tilings[0]; n++)
        for (char up = 'x'; up <= 'z'; up++) {
            sky_tiling s = {0};
            lam_error error = {0};
            ck_assert_int_eq(sky_tiling_create(tilings[n], up, &s, &error), LAM_OK);
            double *L = calloc(2 * s.n_tiles, sizeof *L), *next = L + s.n_tiles;
            for (int k = 0; k < 90; k++) {
                const sun_position sun = sun_of_angles(37 * k, k + .5), moved = sun_of_angles(37 * k, k + .4);
                memset(L, 0, 2 * s.n_tiles * sizeof *L);
                year_spread_sun(&s, sun.direction, 800, L);
                year_spread_sun(&s, moved.direction, 800, next);
                ck_assert_double_eq_tol(received(&s, L), 800, 1e-9 * 800);
                const double reach = 1.5 * sqrt(s.tiles[year_sun_tile(&s, sun.direction)].solid_angle);
                size_t lit = 0;
                for (size_t t = 0; t < s.n_tiles; t++) {
                    double c = 0;
                    for (int d = 0; d < 3; d++)
                        c += s.tiles[t].centre[s.axis[d]] * (double)s.sign[d] * sun.direction[d];
                    ck_assert(L[t] >= 0);
                    lit += L[t] > 0;
                    if (n < 2) ck_assert_int_eq(L[t] > 0, acos(fmin(c, 1)) < reach);
                    /* A tenth of the light at most leaves a tile within a tenth of a degree. */
                    if (n == 0) ck_assert_double_le(fabs(next[t] - L[t]), .1 * 800 / s.tiles[t].cosine);
                }
                ck_assert(lit >= 1);
            }
            free(L);
            sky_tiling_free(&s);
        }
}
END_TEST

/* Clearness and brightness are told of skies by Perez alone; a sky is dark exactly where it cannot be made.
 */
START_TEST(perez_figures_and_darkness) {
    sky_tiling s = tiles_of("tregenza");
    double L[145];
    lam_error error = {0};
    year_sun sun;
    sky_horizontal of;
    const sun_position suns[] = {sun_of_angles(90, 30), sun_of_angles(90, 0), sun_of_angles(90, -.5)};
    const named_sky skies[] = {parsed("even"),
                               parsed("clear"),
                               parsed("turbidity:3"),
                               {.model = SKY_GIVEN, .direct = 800, .diffuse = 100, .dew_point = NAN},
                               {.model = SKY_GIVEN, .direct = 800, .dew_point = NAN},
                               {.model = SKY_GIVEN, .diffuse = 100, .dew_point = NAN},
                               {.model = SKY_GIVEN, .dew_point = NAN}};
    size_t n_dark = 0;
    for (size_t k = 0; k < sizeof skies / sizeof skies[0]; k++)
        for (size_t i = 0; i < 3; i++) {
            const bool made = named_sky_make(&skies[k], &suns[i], &s, true, L, &sun, &of, &error) == LAM_OK;
            ck_assert_int_eq(made, !named_sky_is_dark(&skies[k], &suns[i]));
            n_dark += !made;
            if (made) ck_assert_int_eq(isnan(of.clearness), k < 2);
            if (made) ck_assert_int_eq(isnan(of.brightness), k < 2);
        }
    ck_assert_uint_eq(n_dark, 2 + 2 + 2 + 3);
    /* epsilon = ((D + I) / D + 1.041 Z^3) / (1 + 1.041 Z^3), Z = pi/3; infinite without diffuse light. */
    ck_assert_int_eq(named_sky_make(&skies[3], &suns[0], &s, true, L, &sun, &of, &error), LAM_OK);
    const double cube = 1.041 * pow(M_PI / 3, 3);
    ck_assert_double_eq_tol(of.clearness, (9 + cube) / (1 + cube), 1e-9);
    ck_assert_int_eq(named_sky_make(&skies[4], &suns[0], &s, true, L, &sun, &of, &error), LAM_OK);
    ck_assert(isinf(of.clearness) && of.brightness > 0);
    sky_tiling_free(&s);
}
END_TEST

int main(void) {
    Suite *s = suite_create("named_sky");
    TCase *c = tcase_create("all");
    tcase_set_timeout(c, 60);
    tcase_add_test(c, words);
    tcase_add_test(c, light);
    tcase_add_test(c, clear_shape);
    tcase_add_test(c, turbid_values);
    tcase_add_test(c, dark_and_given);
    tcase_add_test(c, spread);
    tcase_add_test(c, perez_figures_and_darkness);
    tcase_add_test(c, turned);
    tcase_add_test(c, moments);
    suite_add_tcase(s, c);
    return suite_run(s);
}
