/* Spherical harmonics: orthonormal, with the constants and signs of three.js; their integrals over polygons
 * against sums over small parts, and over all polygons about a point. */
#include "solver/base/random.h"
#include "solver/base/vector3.h"
#include "solver/sensor/receiver.h"
#include "support/box.h"
#include "support/suite.h"

/* Products of two of them are polynomials of degree 4: Simpson's rule over 400 cosines is off by 400^-4, and
 * the sum over 8 azimuths is exact. */
START_TEST(orthonormal) {
    enum { COSINES = 400, AZIMUTHS = 8 };
    double G[HARMONICS][HARMONICS] = {{0}};
    for (int i = 0; i <= COSINES; i++)
        for (int k = 0; k < AZIMUTHS; k++) {
            const double z = 2. * i / COSINES - 1, turn = 2 * M_PI * k / AZIMUTHS, level = sqrt(1 - z * z);
            const double simpson = i == 0 || i == COSINES ? 1
                                   : i % 2 == 1           ? 4
                                                          : 2,
                         weight = simpson * (2. / COSINES) / 3 * 2 * M_PI / AZIMUTHS;
            double Y[HARMONICS];
            harmonics_at((double[3]){level * cos(turn), level * sin(turn), z}, Y);
            for (int a = 0; a < HARMONICS; a++)
                for (int b = 0; b < HARMONICS; b++) G[a][b] += weight * Y[a] * Y[b];
        }
    for (int a = 0; a < HARMONICS; a++)
        for (int b = 0; b < HARMONICS; b++) ck_assert_double_eq_tol(G[a][b], a == b, 1e-9);
}
END_TEST

/* The numbers of SphericalHarmonics3 of three.js, which have six decimals. */
START_TEST(constants) {
    static const double x = .48, y = .6, z = .64;
    const double w[3] = {x, y, z}, expected[HARMONICS] = {.282095,
                                                          .488603 * y,
                                                          .488603 * z,
                                                          .488603 * x,
                                                          1.092548 * x * y,
                                                          1.092548 * y * z,
                                                          .315392 * (3 * z * z - 1),
                                                          1.092548 * x * z,
                                                          .546274 * (x * x - y * y)};
    double Y[HARMONICS];
    harmonics_at(w, Y);
    for (int k = 0; k < HARMONICS; k++) ck_assert_double_eq_tol(Y[k], expected[k], 1e-6);
}
END_TEST

/* A probe whose frame is turned, and the receivers of it. */
static receiver probe_at(const double at[3]) {
    return (receiver){
        .kind = RECEIVER_HARMONIC, .at = {at[0], at[1], at[2]}, .axis = {.48, .6, .64}, .look = {.8, 0, -.6}};
}

/* A triangle or a quad at random about the direction z, cut into CELLS x CELLS cells of its unit square: each
 * is taken at its middle, off by its size over the distance, squared, some (2 / 300)^2 / 24 = 2e-6 of the
 * integral of 1. */
START_TEST(polygons) {
    enum { CELLS = 300 };
    for (int k = 0; k < 12; k++) {
        uint64_t seed = (uint64_t)k + 1;
        const double at[3] = {1, -2, .5};
        const receiver r = probe_at(at);
        double sum[HARMONICS] = {0}, solid = 0, found[HARMONICS];
        polygon p = {.n = k % 2 == 0 ? 3 : 4};
        for (int c = 0; c < p.n; c++) {
            const double turn = -2 * M_PI * (c + .6 * random_unit(&seed)) / p.n;
            p.corner[c][0] = at[0] + .9 * cos(turn) + .3;
            p.corner[c][1] = at[1] + .9 * sin(turn) - .2;
            p.corner[c][2] = at[2] + 1.2 + .1 * k;
        }
        if (p.n == 4) /* a parallelogram, whose map is even */
            for (int d = 0; d < 3; d++) p.corner[3][d] = p.corner[0][d] + p.corner[2][d] - p.corner[1][d];
        polygon_measure(&p);
        for (int i = 0; i < CELLS * CELLS; i++) {
            double point[3], way[3], density[HARMONICS];
            const double area = polygon_point(&p, (i / CELLS + .5) / CELLS, (i % CELLS + .5) / CELLS, point);
            subtract3(point, at, way);
            const double square = dot3(way, way);
            for (int d = 0; d < 3; d++) way[d] /= sqrt(square);
            const double each = area / (CELLS * CELLS) * -dot3(way, p.normal) / square;
            receiver_densities(&r, way, density);
            solid += each;
            for (int w = 0; w < HARMONICS; w++) sum[w] += each * density[w];
        }
        receiver_factors(&r, &p, found);
        ck_assert_double_gt(solid, .1);
        for (int w = 0; w < HARMONICS; w++) ck_assert_double_eq_tol(found[w], sum[w], 5e-6 * solid);
        receiver one = r;
        one.kind = RECEIVER_HARMONIC + 5;
        ck_assert_double_eq(receiver_factor(&one, &p), found[5]);
    }
}
END_TEST

/* All that surrounds a point has the integrals 2 / sqrt(pi) and 0, in the middle, near a wall and in a
 * corner: 150 faces, each rounded to 1e-16 of 2 pi. */
START_TEST(all_around) {
    static const double size[3] = {3, 2, 1.5},
                        places[][3] = {{1.1, .7, .6}, {1.1, .7, 1e-4}, {1e-9, 1e-9, 1e-9}};
    mesh m = box_mesh(size, 5, .5f);
    for (size_t k = 0; k < sizeof places / sizeof *places; k++) {
        const receiver r = probe_at(places[k]);
        double sum[HARMONICS] = {0};
        for (size_t j = 0; j < m.n; j++) {
            double factors[HARMONICS];
            polygon p;
            polygon_of_element(&m, j, &p);
            receiver_factors(&r, &p, factors);
            for (int w = 0; w < HARMONICS; w++) sum[w] += factors[w];
        }
        for (int w = 0; w < HARMONICS; w++) ck_assert_double_eq_tol(sum[w], w == 0 ? M_2_SQRTPI : 0, 1e-12);
    }
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *s = suite_create("spherical harmonics");
    TCase *c = tcase_create("all");
    tcase_add_test(c, orthonormal);
    tcase_add_test(c, constants);
    tcase_add_test(c, polygons);
    tcase_add_test(c, all_around);
    suite_add_tcase(s, c);
    return suite_run(s);
}
