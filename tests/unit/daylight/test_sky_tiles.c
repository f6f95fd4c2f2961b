/* Tilings of the sky: closed forms, conventions, and which tile a direction meets. */
#include "solver/base/random.h"
#include "solver/daylight/sky_tiles.h"
#include "support/suite.h"

#include <math.h>
#include <string.h>

static const struct {
    const char *name;
    size_t n_tiles, n_bands;
} tilings[] = {{"tregenza", 145, 8},     {"reinhart:1", 145, 8},      {"reinhart:2", 577, 15},
               {"reinhart:3", 1297, 22}, {"reinhart:16", 36865, 113}, {"grid:12x11", 132, 11},
               {"grid:1x1", 1, 1},       {"grid:1x90", 90, 90},       {"grid:360x1", 360, 1},
               {"grid:7x3", 21, 3}};
enum { N_TILINGS = sizeof tilings / sizeof tilings[0] };

/* East, north and up of the scene's axes, as documented. */
static const struct {
    char up;
    double east[3], north[3], zenith[3];
} frames[] = {{'z', {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
              {'y', {1, 0, 0}, {0, 0, -1}, {0, 1, 0}},
              {'x', {0, 1, 0}, {0, 0, 1}, {1, 0, 0}}};

static sky_tiling make(const char *name, char up) {
    sky_tiling s = {0};
    lam_error error = {0};
    ck_assert_msg(sky_tiling_create(name, up, &s, &error) == LAM_OK, "%s", error.message);
    return s;
}

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* One direction in any place of a packet whose others are elsewhere. */
static size_t find(const sky_tiling *s, float x, float y, float z) {
    static int place;
    float direction[3][SKY_PACKET];
    uint32_t tile[SKY_PACKET];
    place = (place + 1) % SKY_PACKET;
    for (int i = 0; i < SKY_PACKET; i++)
        for (int d = 0; d < 3; d++) direction[d][i] = (float)((3 * i + d) % 7) - 3;
    direction[0][place] = x;
    direction[1][place] = y;
    direction[2][place] = z;
    sky_tiling_find(s, (const float(*)[SKY_PACKET])direction, tile);
    return tile[place];
}

static double uniform(uint64_t *state) {
    return random_lcg_unit(state);
}

START_TEST(tiles_fill_the_sky) {
    for (size_t f = 0; f < 3; f++) {
        sky_tiling s = make(tilings[_i].name, frames[f].up);
        ck_assert_str_eq(s.name, tilings[_i].name);
        ck_assert_uint_eq(s.n_tiles, tilings[_i].n_tiles);
        ck_assert_uint_eq(s.n_bands, tilings[_i].n_bands);
        double solid_angle = 0, cosine = 0;
        for (size_t t = 0; t < s.n_tiles; t++) {
            if (!(s.tiles[t].solid_angle > 0 && s.tiles[t].cosine > 0 &&
                  fabs(dot(s.tiles[t].centre, s.tiles[t].centre) - 1) < 1e-14))
                ck_abort_msg("%s: tile %zu", s.name, t);
            solid_angle += s.tiles[t].solid_angle;
            cosine += s.tiles[t].cosine;
        }
        /* Each of at most 36,865 terms is off by a few units in the last place. */
        ck_assert_double_eq_tol(solid_angle, 2 * M_PI, 1e-12);
        ck_assert_double_eq_tol(cosine, M_PI, 1e-12);
        sky_tiling_free(&s);
    }
}
END_TEST

/* The tiles of each name: sizes, order, north and east. */
START_TEST(conventions) {
    const double degree = M_PI / 180;
    for (size_t f = 0; f < 3; f++) {
        sky_tiling s = make("tregenza", frames[f].up);
        static const uint32_t counts[8] = {30, 30, 24, 24, 18, 12, 6, 1};
        for (size_t b = 0; b < 8; b++) ck_assert_uint_eq(s.bands[b].count, counts[b]);
        ck_assert_double_eq_tol(s.tiles[0].altitude[1], 12 * degree, 1e-15);
        ck_assert_double_eq_tol(s.tiles[0].azimuth[0], -6 * degree, 1e-15);
        ck_assert_double_eq_tol(s.tiles[144].altitude[0], 84 * degree, 1e-14);
        ck_assert_double_eq_tol(s.tiles[144].solid_angle, 2 * M_PI * (1 - cos(6 * degree)), 1e-14);
        ck_assert_double_eq_tol(dot(s.tiles[144].centre, frames[f].zenith), 1, 1e-15);
        /* The first is north, 6 degrees up; the second further east; that of the third band's quarter, east.
         */
        ck_assert_double_eq_tol(dot(s.tiles[0].centre, frames[f].north), cos(6 * degree), 1e-15);
        ck_assert_double_eq_tol(dot(s.tiles[0].centre, frames[f].east), 0, 1e-15);
        ck_assert_double_gt(dot(s.tiles[1].centre, frames[f].east), 0);
        ck_assert_double_eq_tol(dot(s.tiles[60 + 6].centre, frames[f].east), cos(30 * degree), 1e-15);
        sky_tiling_free(&s);
    }
    sky_tiling s = make("reinhart:2", 'z');
    ck_assert_uint_eq(s.bands[1].count, 60);
    ck_assert_uint_eq(s.bands[4].count, 48);
    ck_assert_uint_eq(s.bands[14].count, 1);
    ck_assert_double_eq_tol(s.tiles[0].altitude[1], 90 / 14.5 * degree, 1e-15);
    ck_assert_double_eq_tol(s.tiles[576].altitude[0], (90 - 90 / 29.) * degree, 1e-14);
    sky_tiling_free(&s);
    s = make("grid:12x11", 'z');
    ck_assert_double_eq_tol(s.tiles[131].altitude[0], 10 * M_PI / 22, 1e-15);
    ck_assert_double_eq_tol(s.tiles[131].azimuth[1] - s.tiles[131].azimuth[0], M_PI / 6, 1e-15);
    sky_tiling_free(&s);
}
END_TEST

/* Where it is off the tile's bounds, it is by no more than the angle is (2e-7) and single precision rounds.
 */
START_TEST(directions_meet_their_tile) {
    const double slack = 6e-7;
    uint64_t state = 7;
    for (size_t f = 0; f < 3; f++) {
        sky_tiling s = make(tilings[_i].name, frames[f].up);
        for (size_t k = 0; k < 6000; k++) {
            /* Some along the axes and the horizon, some very steep. */
            float d[3];
            for (int c = 0; c < 3; c++)
                d[c] = (float)((2 * uniform(&state) - 1) * (k % 5 == (size_t)c ? (k % 2 ? 0 : 1e-4) : 3));
            const double v[3] = {(double)d[0], (double)d[1], (double)d[2]};
            const double up = dot(v, frames[f].zenith), east = dot(v, frames[f].east),
                         north = dot(v, frames[f].north);
            const size_t t = find(&s, d[0], d[1], d[2]);
            if (up < 0) {
                if (t != s.n_tiles) ck_abort_msg("%s: below the horizon, tile %zu", s.name, t);
                continue;
            }
            if (t >= s.n_tiles) ck_abort_msg("%s: there is no tile %zu", s.name, t);
            const double altitude = atan2(up, hypot(east, north));
            double azimuth = atan2(east, north);
            if (altitude < s.tiles[t].altitude[0] - slack || altitude > s.tiles[t].altitude[1] + slack)
                ck_abort_msg("%s: tile %zu, altitude %g", s.name, t, altitude);
            if (azimuth < s.tiles[t].azimuth[0] - slack) azimuth += 2 * M_PI;
            if (azimuth < s.tiles[t].azimuth[0] - slack || azimuth > s.tiles[t].azimuth[1] + slack)
                ck_abort_msg("%s: tile %zu, azimuth %g", s.name, t, azimuth);
        }
        for (size_t t = 0; t < s.n_tiles; t++) {
            const double *c = s.tiles[t].centre;
            if (find(&s, (float)c[0], (float)c[1], (float)c[2]) != t)
                ck_abort_msg("%s: the centre of tile %zu", s.name, t);
        }
        const double *z = frames[f].zenith;
        const size_t top = find(&s, (float)z[0], (float)z[1], (float)z[2]);
        ck_assert_uint_ge(top, s.bands[s.n_bands - 1].first);
        ck_assert_uint_lt(top, s.n_tiles);
        sky_tiling_free(&s);
    }
}
END_TEST

START_TEST(names_that_are_none) {
    static const char *const bad[] = {
        "",           "Tregenza",    "tregenza:2",  "reinhart",    "reinhart:",
        "reinhart:0", "reinhart:17", "reinhart:2x", "reinhart:-1", "reinhart:99999999999999999999999",
        "grid:",      "grid:12",     "grid:12x",    "grid:0x1",    "grid:12x91",
        "grid:361x1", "grid:12x11x", "grid: 12x11", "grid:12X11"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        sky_tiling s = {.n_tiles = 77};
        lam_error error = {0};
        ck_assert_msg(sky_tiling_create(bad[i], 'z', &s, &error) == LAM_ERR_ARGUMENT, "%s", bad[i]);
        ck_assert_msg(strstr(error.message, "must be") != NULL, "%s", error.message);
        ck_assert_uint_eq(s.n_tiles, 77);
    }
    sky_tiling s = make("grid:012x0011", 'z');
    ck_assert_str_eq(s.name, "grid:12x11");
    sky_tiling_free(&s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("sky");
    TCase *tiles = tcase_create("tiles");
    tcase_set_timeout(tiles, 60);
    tcase_add_loop_test(tiles, tiles_fill_the_sky, 0, N_TILINGS);
    tcase_add_test(tiles, conventions);
    tcase_add_loop_test(tiles, directions_meet_their_tile, 0, N_TILINGS);
    tcase_add_test(tiles, names_that_are_none);
    suite_add_tcase(suite, tiles);
    return suite_run(suite);
}
