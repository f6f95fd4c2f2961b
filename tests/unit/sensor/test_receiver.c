/* Weights of receivers against closed forms: rectangles, small sources, all around them; and directions that
 * have these weights as their density. */
#include "solver/base/random.h"
#include "solver/base/vector3.h"
#include "solver/sensor/receiver.h"
#include "support/box.h"
#include "support/suite.h"

static const double box_size[3] = {3, 2, 1.5};

/* One of each kind, askew, at a place. */
static void receivers_at(const double at[3], receiver r[RECEIVER_DENSITIES]) {
    static const double axis[3] = {.48, .6, .64}, look[3] = {.8, 0, -.6};
    for (int k = 0; k < RECEIVER_DENSITIES; k++) {
        r[k] = (receiver){.kind = (receiver_kind)k, .at = {at[0], at[1], at[2]}};
        if (k != RECEIVER_SPHERE) memcpy(r[k].axis, axis, sizeof axis);
        if (k == RECEIVER_SEMICYLINDER) memcpy(r[k].look, look, sizeof look);
    }
}

/* The factor of an a x b rectangle at the height 1 above one of its corners, parallel to the plane there. */
static double corner_factor(double a, double b) {
    const double A = sqrt(1 + a * a), B = sqrt(1 + b * b);
    return (a / A * atan(b / A) + b / B * atan(a / B)) / (2 * M_PI);
}

START_TEST(rectangle_above_a_plane) {
    static const double sizes[][2] = {{.3, .3}, {1, .2}, {4, 3}, {50, 40}};
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        const double a = sizes[k][0], b = sizes[k][1];
        const receiver up = {.at = {2, 1, 5}, .axis = {0, 0, 1}},
                       down = {.at = {2, 1, 5}, .axis = {0, 0, -1}};
        polygon p = {.n = 4, .corner = {{2, 1, 6}, {2, 1 + b, 6}, {2 + a, 1 + b, 6}, {2 + a, 1, 6}}};
        polygon_measure(&p);
        ck_assert_double_eq_tol(receiver_factor(&up, &p), corner_factor(a, b), 1e-12);
        ck_assert_double_eq(receiver_factor(&down, &p), 0);
        /* An upright plane at its side: of the rectangle, half lies behind it. */
        const receiver side = {.at = {2 + a / 2, 1 - b, 5}, .axis = {1, 0, 0}};
        polygon half = {
            .n = 4, .corner = {{2 + a / 2, 1, 6}, {2 + a / 2, 1 + b, 6}, {2 + a, 1 + b, 6}, {2 + a, 1, 6}}};
        polygon_measure(&half);
        ck_assert_double_eq_tol(receiver_factor(&side, &p), receiver_factor(&side, &half), 1e-12);
        ck_assert_double_gt(receiver_factor(&side, &p), 0);
    }
    /* Its back gives nothing. */
    polygon back = {.n = 4, .corner = {{0, 0, 2}, {1, 0, 2}, {1, 1, 2}, {0, 1, 2}}};
    polygon_measure(&back);
    receiver r[RECEIVER_DENSITIES];
    receivers_at((double[3]){.5, .5, 1}, r);
    for (int k = 0; k < RECEIVER_DENSITIES; k++) ck_assert_double_eq(receiver_factor(&r[k], &back), 0);
}
END_TEST

/* A source of 1 cm at 2 m: E = L dw times cos, sin e / pi, sin e (1 + cos a) / pi and 1/4, which are off by
 * its size over the distance, squared: 2.5e-5. */
START_TEST(small_source) {
    for (int k = 0; k < 40; k++) {
        uint64_t seed = (uint64_t)k;
        const double z = random_between(&seed, -.95, .95), turn = random_between(&seed, 0, 2 * M_PI);
        const double level = sqrt(1 - z * z), way[3] = {level * cos(turn), level * sin(turn), z};
        double u[3] = {-sin(turn), cos(turn), 0}, w[3];
        polygon p = {.n = k % 2 == 0 ? 3 : 4};
        cross3(u, way, w);
        /* corners about its centroid: a square, or the three first corners of it */
        const double square[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}},
                     off[2] = {p.n == 3 ? 1. / 3 : 0, p.n == 3 ? -1. / 3 : 0};
        for (int c = 0; c < p.n; c++)
            for (int d = 0; d < 3; d++)
                p.corner[c][d] =
                    2 * way[d] + .005 * ((square[c][0] - off[0]) * u[d] + (square[c][1] - off[1]) * w[d]);
        polygon_measure(&p);
        const double omega = polygon_area(&p) / 4;
        const receiver of[RECEIVER_DENSITIES] = {
            {.kind = RECEIVER_PLANE, .axis = {0, 0, 1}},
            {.kind = RECEIVER_CYLINDER, .axis = {0, 0, 1}},
            {.kind = RECEIVER_SEMICYLINDER, .axis = {0, 0, 1}, .look = {0, 1, 0}},
            {.kind = RECEIVER_SPHERE}};
        const double expected[RECEIVER_DENSITIES] = {fmax(z, 0) * omega, level / M_PI * omega,
                                                     level * (1 + sin(turn)) / M_PI * omega, omega / 4};
        for (int r = 0; r < RECEIVER_DENSITIES; r++)
            /* 1e-3 as luminaires ask for; where a weight is near 0 it is off by the source's half width */
            ck_assert_double_eq_tol(M_PI * receiver_factor(&of[r], &p), expected[r],
                                    1e-3 * expected[r] + .0025 * omega * (expected[r] < .01 * omega));
    }
}
END_TEST

/* All that surrounds a receiver has the factor 1, whatever its kind and wherever it is: in the middle, on a
 * wall or a tenth of a millimetre above it. Quadrature is allowed 1e-5 (receiver.h). */
START_TEST(furnace) {
    static const double places[][3] = {{1.1, .7, .6}, {2.9, 1.9, 1.4}, {1.1, .7, 1e-4}, {1e-9, 1e-9, 1e-9}};
    mesh m = box_mesh(box_size, 5, .5f);
    for (size_t k = 0; k < sizeof places / sizeof *places; k++) {
        receiver r[RECEIVER_DENSITIES];
        receivers_at(places[k], r);
        for (int kind = 0; kind < RECEIVER_DENSITIES; kind++) {
            double sum = 0;
            for (size_t j = 0; j < m.n; j++) {
                polygon p;
                polygon_of_element(&m, j, &p);
                sum += receiver_factor(&r[kind], &p);
            }
            ck_assert_msg(fabs(sum - 1) < 1e-5, "place %zu, kind %d: %.9f", k, kind, sum);
        }
    }
    mesh_free(&m);
}
END_TEST

/* The share of directions that meet a face of the box is its factor. A grid of SIDE x SIDE cells, a point at
 * random in each, is off by the cells on the rim: some 8 SIDE of them, each by half at random. */
START_TEST(directions) {
    enum { SIDE = 200, FACES = 6 };
    mesh m = box_mesh(box_size, 1, .5f);
    receiver r[RECEIVER_DENSITIES];
    receivers_at((double[3]){1.1, .7, .6}, r);
    for (int kind = 0; kind < RECEIVER_DENSITIES; kind++) {
        double share[FACES] = {0};
        uint64_t seed = 1;
        for (int i = 0; i < SIDE * SIDE; i++) {
            double way[3], nearest = INFINITY;
            int face = 0;
            receiver_direction(&r[kind], (i / SIDE + random_unit(&seed)) / SIDE,
                               (i % SIDE + random_unit(&seed)) / SIDE, way);
            ck_assert_double_eq_tol(dot3(way, way), 1, 1e-12);
            for (int d = 0; d < 3; d++) {
                const double t = ((way[d] > 0 ? box_size[d] : 0) - r[kind].at[d]) / way[d];
                if (t < nearest) face = 2 * d + (way[d] > 0);
                nearest = fmin(t, nearest);
            }
            share[face] += 1. / (SIDE * SIDE);
        }
        for (size_t f = 0; f < FACES; f++) {
            polygon p;
            polygon_of_element(&m, f, &p);
            ck_assert_double_eq_tol(share[f], receiver_factor(&r[kind], &p),
                                    4 * sqrt(8. * SIDE / 4) / (SIDE * SIDE));
        }
    }
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *s = suite_create("receivers");
    TCase *c = tcase_create("all");
    tcase_add_test(c, rectangle_above_a_plane);
    tcase_add_test(c, small_source);
    tcase_add_test(c, furnace);
    tcase_add_test(c, directions);
    suite_add_tcase(s, c);
    return suite_run(s);
}
