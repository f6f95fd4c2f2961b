/* The all-weather sky: parameters by hand, and on tiles what a sky must be: exact, positive, symmetric,
 * bright where the sun is when it is clear, at the zenith when it is not. */
#include "solver/daylight/year.h"
#include "support/suite.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define DEGREE (M_PI / 180)

static const char *const tilings[] = {"tregenza",   "reinhart:2", "reinhart:4",
                                      "grid:12x11", "grid:1x1",   "grid:7x90"};
enum { N_TILINGS = sizeof tilings / sizeof tilings[0] };

static sky_tiling tiles_of(const char *name, char up) {
    sky_tiling s = {0};
    lam_error error = {0};
    ck_assert_msg(sky_tiling_create(name, up, &s, &error) == LAM_OK, "%s", error.message);
    return s;
}

static sun_position sun_in(double altitude, double azimuth) {
    const double h = altitude * DEGREE, a = azimuth * DEGREE;
    return (sun_position){
        .altitude = h, .azimuth = a, .direction = {cos(h) * sin(a), cos(h) * cos(a), sin(h)}, .distance = 1};
}

static double *sky_of(const sky_tiling *s, sun_position sun, double direct, double diffuse) {
    const perez_sky p = perez_sky_of(&sun, direct, diffuse);
    double *L = malloc(s->n_tiles * sizeof *L);
    ck_assert_ptr_nonnull(L);
    for (size_t t = 0; t < s->n_tiles; t++) L[t] = NAN;
    year_add_sky(s, &p, &sun, diffuse, L);
    return L;
}

static double irradiance(const sky_tiling *s, const double *L) {
    double sum = 0;
    for (size_t t = 0; t < s->n_tiles; t++) sum += L[t] * s->tiles[t].cosine;
    return sum;
}

START_TEST(parameters) {
    /* Kasten's air mass at 60 degrees is 1/(.5 + .15 * 33.885^-1.253) = 1.9928. */
    perez_sky p = perez_sky_of(&(sun_position){.altitude = 30 * DEGREE, .distance = 1}, 0, 200);
    ck_assert_double_eq(p.clearness, 1);
    ck_assert_int_eq(p.bin, 0);
    ck_assert_double_eq_tol(p.brightness, 200 * 1.9928 / 1367, 1e-5);
    /* These are found by hand from table 1, with z = pi/3 and Delta = .29156: eq. 6, and 7 and 8 for c and
     * d. */
    const double z = M_PI / 3, D = p.brightness;
    ck_assert_double_eq_tol(p.a, .5657, 1e-4);
    ck_assert_double_eq_tol(p.b, -.4326, 1e-4);
    ck_assert_double_eq_tol(p.c, exp(pow(D * (2.8 + .6004 * z), 1.2375)) - 1, 1e-12);
    ck_assert_double_eq_tol(p.d, -exp(D * (1.8734 + .6297 * z)) + .9738 + .2809 * D, 1e-12);
    /* Clearness with the sun at the zenith is (diffuse + direct)/diffuse; its bins begin where table 1 says.
     */
    static const double from[7] = {1.065, 1.23, 1.5, 1.95, 2.8, 4.5, 6.2};
    const sun_position zenith = {.altitude = 90 * DEGREE, .distance = 1};
    for (int i = 0; i < 7; i++) {
        ck_assert_int_eq(perez_sky_of(&zenith, 100 * (from[i] - 1) - .01, 100).bin, i);
        ck_assert_int_eq(perez_sky_of(&zenith, 100 * (from[i] - 1) + .01, 100).bin, i + 1);
    }
    ck_assert_double_eq_tol(perez_sky_of(&zenith, 300, 100).clearness, 4, 1e-12);
    /* At 60 degrees 1.041 z^3 = 1.19547. */
    ck_assert_double_eq_tol(
        perez_sky_of(&(sun_position){.altitude = 30 * DEGREE, .distance = 1}, 300, 100).clearness,
        (4 + 1.19547) / 2.19547, 1e-5);
    /* Further from the sun less comes in, so that the same diffuse light is a brighter sky. */
    p = perez_sky_of(&(sun_position){.altitude = 30 * DEGREE, .distance = 1.0167}, 0, 200);
    ck_assert_double_eq_tol(p.brightness, D * 1.0167 * 1.0167, 1e-12);
    /* No diffuse light: clear, and nothing is divided by it. */
    p = perez_sky_of(&(sun_position){.altitude = 30 * DEGREE, .distance = 1}, 300, 0);
    ck_assert_int_eq(p.bin, 7);
    ck_assert(isinf(p.clearness) && isfinite(p.a + p.b + p.c + p.d + p.e));
}
END_TEST

/* 1990, eq. 7 and 8, by hand. */
START_TEST(efficacies) {
    ck_assert_double_eq(perez_water(NAN), 2);
    ck_assert_double_eq_tol(perez_water(11), exp(.695), 1e-12);
    const perez_sky overcast = {.zenith = 60 * DEGREE, .brightness = .3, .bin = 0};
    ck_assert_double_eq_tol(perez_diffuse_efficacy(&overcast, 2), 97.24 - .92 + 6 + 8.91 * 1.2039728, 1e-5);
    const perez_sky clear = {.zenith = 60 * DEGREE, .brightness = .1, .bin = 7};
    ck_assert_double_eq_tol(perez_diffuse_efficacy(&clear, 2), 152.23 + .7 - 22.635 + 7.98 * 2.3025851, 1e-5);
    /* exp(5.73 pi/3 - 5) = 2.7195 */
    ck_assert_double_eq_tol(perez_direct_efficacy(&clear, 2), 101.18 + 3.16 - 1.10 * 2.7195 - .829, 1e-3);
    const perez_sky low = {.zenith = 90 * DEGREE, .brightness = .1, .bin = 0};
    ck_assert_double_eq(perez_direct_efficacy(&low, 2), 0); /* 57.2 - 9.1 - 2.98 * 54.6 + 11.7 is below 0 */
}
END_TEST

/* For every kind of weather the irradiance of the sky is the given one and no radiance is negative. */
START_TEST(exact_and_positive) {
    static const double directs[] = {0, .1, 20, 200, 900, 3000}, diffuses[] = {.1, 5, 60, 300, 3000};
    static const double altitudes[] = {-30, -1, 0, .01, 2, 15, 45, 80, 90};
    sky_tiling s = tiles_of(tilings[_i], 'z');
    for (size_t h = 0; h < sizeof altitudes / sizeof *altitudes; h++)
        for (size_t i = 0; i < sizeof directs / sizeof *directs; i++)
            for (size_t k = 0; k < sizeof diffuses / sizeof *diffuses; k++) {
                double *L = sky_of(&s, sun_in(altitudes[h], 37), directs[i], diffuses[k]);
                ck_assert(fabs(irradiance(&s, L) / diffuses[k] - 1) < 1e-12);
                for (size_t t = 0; t < s.n_tiles; t++) ck_assert(L[t] >= 0 && isfinite(L[t]));
                free(L);
            }
    sky_tiling_free(&s);
}
END_TEST

/* The tile of a direction, by its angles. */
static size_t tile_at(const sky_tiling *s, double altitude, double azimuth) {
    for (size_t t = 0; t < s->n_tiles; t++) {
        const double turn =
            remainder(azimuth * DEGREE - .5 * (s->tiles[t].azimuth[0] + s->tiles[t].azimuth[1]), 2 * M_PI);
        if (altitude * DEGREE >= s->tiles[t].altitude[0] && altitude * DEGREE < s->tiles[t].altitude[1] &&
            fabs(turn) <= .5 * (s->tiles[t].azimuth[1] - s->tiles[t].azimuth[0]))
            return t;
    }
    ck_abort_msg("no tile");
    return 0;
}

START_TEST(clear_sky) {
    sky_tiling s = tiles_of("tregenza", 'z');
    double *L = sky_of(&s, sun_in(42, 120), 850, 80);
    const size_t sun = tile_at(&s, 42, 120);
    for (size_t t = 0; t < s.n_tiles; t++) ck_assert(L[t] <= L[sun]);
    ck_assert_double_gt(L[sun], 4 * L[tile_at(&s, 42, 300)]);
    /* Darkest well away from the sun and the horizon, some 90 degrees from it. */
    ck_assert_double_lt(L[tile_at(&s, 54, 300)], L[tile_at(&s, 6, 300)]);
    ck_assert_double_lt(L[tile_at(&s, 54, 300)], L[144]);
    free(L);
    sky_tiling_free(&s);
}
END_TEST

/* The zenith of Moon and Spencer's overcast sky is three times as bright as its horizon; the fit of 1993 to
 * all the skies of its first bin is less steep: 1 + a exp(b) with a = 1.35 and b = -.77 at most, less what
 * the sun behind the clouds adds lower down. */
START_TEST(overcast_sky) {
    sky_tiling s = tiles_of("reinhart:2", 'z');
    double *L = sky_of(&s, sun_in(40, 120), 0, 200);
    double horizon = 0;
    for (uint32_t k = 0; k < s.bands[0].count; k++) horizon += L[k] / s.bands[0].count;
    ck_assert_double_gt(L[s.n_tiles - 1] / horizon, 1.3);
    ck_assert_double_lt(L[s.n_tiles - 1] / horizon, 3);
    for (size_t b = 1; b < s.n_bands; b++) /* ever brighter upwards, opposite the sun */
        ck_assert_double_gt(L[tile_at(&s, (double)b * 90 / 14.5 + 1, 300)],
                            L[tile_at(&s, (double)(b - 1) * 90 / 14.5 + 1, 300)]);
    free(L);
    sky_tiling_free(&s);
}
END_TEST

/* A sun in the south mirrors east and west; 60 degrees are whole tiles of every band of tregenza. */
START_TEST(symmetries) {
    static const double skies[][2] = {{0, 200}, {100, 200}, {400, 150}, {850, 80}};
    sky_tiling s = tiles_of("tregenza", 'z'), y = tiles_of("tregenza", 'y');
    for (size_t w = 0; w < sizeof skies / sizeof *skies; w++) {
        double *south = sky_of(&s, sun_in(35, 180), skies[w][0], skies[w][1]);
        double *turned = sky_of(&s, sun_in(35, 240), skies[w][0], skies[w][1]);
        double *other = sky_of(&y, sun_in(35, 180), skies[w][0], skies[w][1]);
        for (size_t b = 0; b < s.n_bands; b++) {
            const uint32_t n = s.bands[b].count, first = s.bands[b].first;
            for (uint32_t k = 0; k < n; k++) {
                const double L = south[first + k];
                ck_assert(fabs(L - south[first + (n - k) % n]) <= 1e-10 * L);
                ck_assert(n == 1 || fabs(L - turned[first + (k + n / 6) % n]) <= 1e-10 * L);
                ck_assert(L == other[first + k]); /* tiles are the same whatever axis points up */
            }
        }
        free(south);
        free(turned);
        free(other);
    }
    sky_tiling_free(&s);
    sky_tiling_free(&y);
}
END_TEST

/* A little more light, a sun a little further: a sky a little different. */
START_TEST(continuous) {
    sky_tiling s = tiles_of("grid:12x6", 'z');
    for (double altitude = 1; altitude < 90; altitude += 11)
        for (double direct = 3; direct < 1000; direct *= 2.5) {
            double *L = sky_of(&s, sun_in(altitude, 100), direct, 100);
            double *more = sky_of(&s, sun_in(altitude, 100), direct, 100.00001);
            double *later = sky_of(&s, sun_in(altitude + 1e-5, 100.00001), direct, 100);
            double most = 0;
            for (size_t t = 0; t < s.n_tiles; t++) most = fmax(most, L[t]);
            for (size_t t = 0; t < s.n_tiles; t++)
                ck_assert(fabs(L[t] - more[t]) < 1e-4 * most && fabs(L[t] - later[t]) < 1e-4 * most);
            free(L);
            free(more);
            free(later);
        }
    sky_tiling_free(&s);
}
END_TEST

/* The mean over coarse tile t of what 25 fine tiles have. */
static double mean_of_parts(const sky_tile *t, const sky_tiling *fine, const double *parts) {
    double sum = 0;
    size_t found = 0;
    for (size_t f = 0; f < fine->n_tiles; f++) {
        const sky_tile *part = &fine->tiles[f];
        const double middle = .5 * (part->altitude[0] + part->altitude[1]);
        const double turn =
            remainder(.5 * (part->azimuth[0] + part->azimuth[1] - t->azimuth[0] - t->azimuth[1]), 2 * M_PI);
        if (fabs(turn) > .5 * (t->azimuth[1] - t->azimuth[0]) || middle < t->altitude[0] ||
            middle > t->altitude[1])
            continue;
        sum += parts[f] * part->solid_angle / t->solid_angle;
        found++;
    }
    ck_assert(found == 25);
    return sum;
}

/* Fine tiles average to coarse ones, up to one factor: a coarse tile gives a horizontal plane its mean
 * radiance times its mean cosine, not the mean of the product. The rest is the spacing of directions, 3
 * degrees here, 1.5 there: about (3/8)^2/24 of what falls to 1/e in 8 degrees, and more in the tile where it
 * has its peak. */
START_TEST(means_of_tiles) {
    sky_tiling s = tiles_of("grid:12x6", 'z'), fine = tiles_of("grid:60x30", 'z');
    for (double altitude = 1; altitude < 90; altitude += 11)
        for (double direct = 3; direct < 1000; direct *= 2.5) {
            double *L = sky_of(&s, sun_in(altitude, 100), direct, 100);
            double *parts = sky_of(&fine, sun_in(altitude, 100), direct, 100);
            double most = 0, coarse_sum = 0, fine_sum = 0;
            for (size_t t = 0; t < s.n_tiles; t++) {
                most = fmax(most, L[t]);
                coarse_sum += L[t] * s.tiles[t].solid_angle;
            }
            for (size_t f = 0; f < fine.n_tiles; f++) fine_sum += parts[f] * fine.tiles[f].solid_angle;
            for (size_t t = 0; t < s.n_tiles; t++)
                ck_assert(fabs(mean_of_parts(&s.tiles[t], &fine, parts) * coarse_sum / fine_sum - L[t]) <
                          .03 * most);
            ck_assert_double_eq_tol(coarse_sum / fine_sum, 1, .06);
            free(L);
            free(parts);
        }
    sky_tiling_free(&s);
    sky_tiling_free(&fine);
}
END_TEST

/* One tile, the one the sun is in, and exactly what a horizontal plane receives. */
START_TEST(sun) {
    for (size_t up = 0; up < 3; up++) {
        sky_tiling s = tiles_of(tilings[_i], "xyz"[up]);
        double *L = calloc(s.n_tiles, sizeof *L);
        ck_assert_ptr_nonnull(L);
        for (double altitude = .37; altitude < 90; altitude += 3.1)
            for (double azimuth = -179.3; azimuth < 180; azimuth += 17.7) {
                const sun_position at = sun_in(altitude, azimuth);
                memset(L, 0, s.n_tiles * sizeof *L);
                year_add_sun(&s, at.direction, 700, L);
                ck_assert(fabs(irradiance(&s, L) - 700) < 1e-10);
                ck_assert(L[tile_at(&s, altitude, azimuth)] > 0);
            }
        const sun_position low = sun_in(1e-300, 10);
        memset(L, 0, s.n_tiles * sizeof *L);
        year_add_sun(&s, low.direction, 1, L);
        ck_assert_double_eq_tol(irradiance(&s, L), 1, 1e-12);
        free(L);
        sky_tiling_free(&s);
    }
}
END_TEST

/* Rows of a year: night is dark, a sun below the horizon gives nothing and is counted, horizontal direct
 * light is taken for what it is. */
START_TEST(year) {
    weather_hour hours[] = {{2001, 6, 21, .5, 0, 0, NAN},    {2001, 6, 21, 2.5, 40, 0, NAN},
                            {2001, 6, 21, 3.5, 90, 7, NAN},  {2001, 6, 21, 12.5, 800, 0, 11},
                            {2001, 6, 21, 13.5, 0, 250, 11}, {2001, 6, 21, 9.5, 500, 150, 11}};
    enum { N = sizeof hours / sizeof hours[0] };
    weather w = {.latitude = 40, .longitude = 15, .time_zone = 1, .n = N, .hours = hours};
    sky_tiling s = tiles_of("tregenza", 'z');
    float L[N][145], light[N][145], flat[N][145];
    double sums[N] = {0}, horizontal[N] = {0};
    const year_options plain = {.sun_in_tiles = true}, bright = {.sun_in_tiles = true, .photometric = true};
    year_summary sum = {0}, lit = {0}, other = {0};
    year_sun suns[N];
    lam_error error = {0};
    ck_assert_int_eq(year_skies(&w, &s, &plain, NULL, L[0], NULL, &sum, &error), LAM_OK);
    for (size_t i = 0; i < N; i++) {
        const sun_position at = sun_at(40, 15, 1, 2001, 6, 21, hours[i].hour);
        for (size_t t = 0; t < 145; t++) sums[i] += (double)L[i][t] * s.tiles[t].cosine;
        horizontal[i] = at.altitude > 0 ? hours[i].direct * sin(at.altitude) : 0;
        /* Each of 145 radiances is rounded to single precision. */
        ck_assert_double_eq_tol(sums[i], hours[i].diffuse + horizontal[i], 1e-6 * (1 + sums[i]));
    }
    ck_assert_uint_eq(sum.lit, 4);
    ck_assert_uint_eq(sum.sunny, 2);
    ck_assert_uint_eq(sum.sunless, 2);
    ck_assert_double_eq(sum.left_out, 90);
    ck_assert_double_eq(sum.diffuse, 407);
    ck_assert_double_eq_tol(sum.direct, horizontal[3] + horizontal[5], 1e-9);
    ck_assert_double_eq_tol(sum.light, sum.direct + 407, 1e-9);
    /* Skies without their suns, and the suns beside them. */
    ck_assert_int_eq(
        year_skies(&w, &s, &(year_options){.photometric = false}, NULL, flat[0], suns, &other, &error),
        LAM_OK);
    for (size_t i = 0; i < N; i++) {
        double whole[145];
        const bool sunny = i == 3 || i == 5;
        for (size_t t = 0; t < 145; t++) whole[t] = (double)flat[i][t];
        ck_assert_double_eq_tol(suns[i].horizontal, horizontal[i], 1e-9);
        ck_assert_double_eq_tol(suns[i].normal, sunny ? hours[i].direct : 0, 1e-9);
        if (sunny) year_add_sun(&s, suns[i].direction, suns[i].horizontal, whole);
        for (size_t t = 0; t < 145; t++) ck_assert(fabs(whole[t] - (double)L[i][t]) <= 1e-6 * whole[t]);
        ck_assert(i != 3 || (flat[i][0] == 0 && suns[i].direction[1] < 0 && suns[i].direction[2] > .9));
    }
    /* The skies in light: every hour has between 60 and 150 lm/W, and the tile of the sun alone has light
     * where there is but sun.
     */
    ck_assert_int_eq(year_skies(&w, &s, &bright, NULL, light[0], NULL, &lit, &error), LAM_OK);
    for (size_t i = 0; i < N; i++)
        for (size_t t = 0; t < 145; t++)
            ck_assert(L[i][t] == 0 ? light[i][t] == 0
                                   : light[i][t] > 60 * L[i][t] && light[i][t] < 150 * L[i][t]);
    ck_assert_double_eq_tol(lit.light / (sum.diffuse + sum.direct), 105, 15);
    /* The same year with its direct light on a horizontal plane. */
    for (size_t i = 0; i < N; i++) hours[i].direct = hours[i].direct > 0 ? fmax(horizontal[i], 1) : 0;
    w.direct_is_horizontal = true;
    ck_assert_int_eq(year_skies(&w, &s, &plain, NULL, flat[0], NULL, &other, &error), LAM_OK);
    for (size_t i = 0; i < N; i++)
        for (size_t t = 0; t < 145; t++) ck_assert(fabsf(flat[i][t] - L[i][t]) <= 1e-5f * L[i][t]);
    ck_assert_double_eq_tol(other.direct, sum.direct, 1e-9);
    /* It faces the sun again, but a sun that is all but down gives no more than there is above the air. */
    hours[0] = (weather_hour){2001, 6, 21, 19.43, 40, 9, NAN};
    ck_assert_int_eq(year_skies(&w, &s, &plain, NULL, flat[0], suns, &other, &error), LAM_OK);
    ck_assert_double_eq_tol(suns[3].normal, 800, 1e-9);
    ck_assert(suns[0].horizontal == 40 && suns[0].direction[2] > 0 && 40 / suns[0].direction[2] > 1400);
    ck_assert(suns[0].normal > 1300 && suns[0].normal < 1367);
    sky_tiling_free(&s);
}
END_TEST

static bool stop(void *context) {
    (void)context;
    return true;
}

START_TEST(cancelled) {
    weather_hour hour = {2001, 6, 21, 12, 100, 100, NAN};
    const weather w = {.n = 1, .hours = &hour};
    sky_tiling s = tiles_of("grid:1x1", 'z');
    float L = 7;
    year_summary sum = {.lit = 77};
    lam_error error = {0};
    ck_assert_int_eq(year_skies(&w, &s, &(year_options){.sun_in_tiles = true}, &(progress){.cancelled = stop},
                                &L, NULL, &sum, &error),
                     LAM_ERR_CANCELLED);
    ck_assert_uint_eq(sum.lit, 77);
    sky_tiling_free(&s);
}
END_TEST

int main(void) {
    Suite *s = suite_create("perez");
    TCase *c = tcase_create("all");
    tcase_set_timeout(c, 120);
    tcase_add_test(c, parameters);
    tcase_add_test(c, efficacies);
    tcase_add_loop_test(c, exact_and_positive, 0, N_TILINGS);
    tcase_add_test(c, clear_sky);
    tcase_add_test(c, overcast_sky);
    tcase_add_test(c, symmetries);
    tcase_add_test(c, continuous);
    tcase_add_test(c, means_of_tiles);
    tcase_add_loop_test(c, sun, 0, N_TILINGS);
    tcase_add_test(c, year);
    tcase_add_test(c, cancelled);
    suite_add_tcase(s, c);
    return suite_run(s);
}
