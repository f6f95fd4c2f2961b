/* Visibility segments: eight at a time against one point after the other, and which of them are blocked. */
#include "solver/base/random.h"
#include "solver/formfactor/exchange/affine_segments.h"
#include "solver/formfactor/visibility/visibility.h"
#include "support/box.h"
#include "support/polygon_corners.h"
#include "support/suite.h"

#include <math.h>

/* The kernel between two points, 0 behind either polygon. */
static double kernel_of(const polygon *a, const double x[3], const polygon *b, const double y[3]) {
    double r2 = 0, leaving = 0, arriving = 0;
    for (int d = 0; d < 3; d++) {
        const double r = y[d] - x[d];
        r2 += r * r;
        leaving += r * a->normal[d];
        arriving -= r * b->normal[d];
    }
    return leaving > 0 && arriving > 0 ? leaving * arriving / (r2 * r2) : 0;
}

/* Triangles, parallelograms and other planar quads in all combinations, of which some points face away from
 * each other. A sum of a few products of numbers below 8 is off by some 2^-50, the kernel by that over its
 * r^4 > 1e-3, and a coordinate in single precision by 2^-24 times 8, once for each end. */
START_TEST(eight_segments_are_as_one) {
    const double triangle[3][3] = {{0, 0, 0}, {2, .1, .2}, {.3, 1.1, -.1}},
                 tilted[3][3] = {{.5, .2, 1}, {.4, 1.9, .9}, {1.9, .1, -.3}},
                 parallelogram[4][3] = {{0, 0, 0}, {2, .1, .2}, {2.3, 1.2, .1}, {.3, 1.1, -.1}},
                 other[4][3] = {{.5, .2, 1}, {.4, 1.9, .9}, {1.8, 1.8, -.4}, {1.9, .1, -.3}};
    /* The second corner of the other quads lies within the plane of the others. */
    double trapezoid[4][3], kite[4][3];
    for (int c = 0; c < 4; c++)
        for (int d = 0; d < 3; d++) {
            trapezoid[c][d] = parallelogram[c][d];
            kite[c][d] = other[c][d];
            if (c != 2) continue;
            trapezoid[c][d] += .4 * (parallelogram[1][d] - parallelogram[0][d]);
            kite[c][d] += .5 * (other[1][d] - other[0][d]) + .3 * (other[3][d] - other[0][d]);
        }
    const polygon a = _i % 3 == 0   ? polygon_of_corners(3, triangle)
                      : _i % 3 == 1 ? polygon_of_corners(4, parallelogram)
                                    : polygon_of_corners(4, (const double(*)[3])trapezoid),
                  b = _i / 3 == 0   ? polygon_of_corners(3, tilted)
                      : _i / 3 == 1 ? polygon_of_corners(4, other)
                                    : polygon_of_corners(4, (const double(*)[3])kite);
    const affine_pair pair = {affine_map_of(&a), affine_map_of(&b)};
    const double centre[3] = {.7, -.3, .2};
    uint64_t seed = 5;
    size_t behind = 0, in_front = 0;
    ck_assert(a.affine == (_i % 3 != 2) && b.affine == (_i / 3 != 2));
    double first = 0; /* the kernel over that of the points, which differ by a constant */
    for (int packet = 0; packet < 200; packet++) {
        double x[4][AFFINE_SEGMENTS], K[AFFINE_SEGMENTS];
        float origin[3][AFFINE_SEGMENTS], direction[3][AFFINE_SEGMENTS];
        for (int d = 0; d < 4; d++)
            for (int k = 0; k < AFFINE_SEGMENTS; k++) x[d][k] = random_unit(&seed);
        const unsigned bits = affine_segments(&pair, x, centre, origin, direction, K);
        for (int k = 0; k < AFFINE_SEGMENTS; k++) {
            ck_assert((bits >> k & 1) == (K[k] > 0));
            double from[3], to[3];
            const double areas =
                polygon_point(&a, x[0][k], x[1][k], from) * polygon_point(&b, x[2][k], x[3][k], to);
            const double wanted = areas * kernel_of(&a, from, &b, to);
            if (!(first > 0) && wanted > .1) first = K[k] / wanted;
            if (first > 0) ck_assert_double_eq_tol(K[k], first * wanted, 1e-9 * first);
            if (!(first > 0)) ck_assert((K[k] > 0) == (wanted > 0));
            behind += K[k] == 0;
            in_front += K[k] > 0;
            for (int d = 0; d < 3; d++) {
                ck_assert_double_eq_tol((double)origin[d][k], from[d] - centre[d], 8 * 0x1p-24);
                ck_assert_double_eq_tol((double)direction[d][k], to[d] - from[d], 16 * 0x1p-24);
            }
        }
    }
    ck_assert_double_gt(first, 0);
    ck_assert_uint_gt(behind, 20);
    ck_assert_uint_gt(in_front, 20);
}
END_TEST

/* Where both ends are the same point the kernel is 0, not 0/0. */
START_TEST(a_segment_of_no_length_has_no_kernel) {
    const polygon floor = polygon_of_corners(3, (const double[3][3]){{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}),
                  wall = polygon_of_corners(3, (const double[3][3]){{0, 0, 0}, {0, 1, 0}, {0, 0, 1}});
    const affine_pair pair = {affine_map_of(&floor), affine_map_of(&wall)};
    const double x[4][AFFINE_SEGMENTS] = {{0}}, centre[3] = {0};
    double K[AFFINE_SEGMENTS];
    float origin[3][AFFINE_SEGMENTS], direction[3][AFFINE_SEGMENTS];
    affine_segments(&pair, x, centre, origin, direction, K);
    for (int k = 0; k < AFFINE_SEGMENTS; k++) ck_assert_double_eq(K[k], 0);
}
END_TEST

/* A floor (0) and a wall (1) that meet at an edge, a ceiling (2), a plate in mid-air (3) with its underside
 * (4), and a rug (5) in the plane of the floor. The corner is blunt or acute: the wall leans by lean. bent:
 * a corner of the floor is off its plane by this. */
enum { FLOOR, WALL, CEILING, PLATE, UNDERSIDE, RUG };

static mesh corner_with_plate(double lean, double bent) {
    mesh m = {0};
    mesh_add_quad(&m, (const double[4][3]){{0, 0, 0}, {1, 0, 0}, {1, 1, bent}, {0, 1, 0}});
    mesh_add_quad(&m, (const double[4][3]){{0, 0, 0}, {0, 1, 0}, {lean, 1, 1}, {lean, 0, 1}});
    mesh_add_quad(&m, (const double[4][3]){{0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}});
    mesh_add_quad(&m, (const double[4][3]){{.6, .3, .5}, {.9, .3, .5}, {.9, .7, .5}, {.6, .7, .5}});
    mesh_add_quad(&m, (const double[4][3]){{.6, .3, .5}, {.6, .7, .5}, {.9, .7, .5}, {.9, .3, .5}});
    mesh_add_quad(&m, (const double[4][3]){{.2, .2, 0}, {.4, .2, 0}, {.4, .4, 0}, {.2, .4, 0}});
    mesh_finish(&m, .5f);
    return m;
}

/* True if one segment between points of two elements is blocked. */
static bool is_blocked(const visibility *v, uint32_t from, const double x[3], uint32_t to,
                       const double y[3]) {
    ray_packet segments = {.origin = {{0}}};
    float begin[3], end[3];
    visibility_recentre(v, x, begin);
    visibility_recentre(v, y, end);
    for (int d = 0; d < 3; d++) {
        segments.origin[d][0] = begin[d];
        segments.direction[d][0] = end[d] - begin[d];
    }
    return visibility_blocked(v, &segments, 1, &from, &to) != 0;
}

/* From the floor and the ceiling only the plate blocks, where the segment passes through it; neither the rug
 * nor a floor that is bent by more than the ends are lifted does. */
START_TEST(only_what_stands_between_blocks) {
    const double bent[3] = {0, 2e-6, -2e-6};
    mesh m = corner_with_plate(0, bent[_i]);
    visibility *v = NULL;
    lam_error error = {0};
    ck_assert_msg(visibility_create(&m, &v, &error) == LAM_OK, "%s", error.message);
    uint64_t seed = 3;
    size_t hidden = 0, open = 0;
    for (int k = 0; k < 4000; k++) {
        const double x[3] = {random_unit(&seed), random_unit(&seed), 0},
                     y[3] = {random_unit(&seed), random_unit(&seed), 1};
        const double u = .5 * (x[0] + y[0]), w = .5 * (x[1] + y[1]);
        const bool through = u > .6 && u < .9 && w > .3 && w < .7;
        if (fmin(fabs(u - .6), fabs(u - .9)) < 1e-5 || fmin(fabs(w - .3), fabs(w - .7)) < 1e-5) continue;
        ck_assert_int_eq(is_blocked(v, FLOOR, x, CEILING, y), through);
        ck_assert_int_eq(is_blocked(v, CEILING, y, FLOOR, x), through);
        ck_assert(!is_blocked(v, UNDERSIDE, (const double[3]){.7, .5, .5}, FLOOR, x));
        ck_assert(!is_blocked(v, PLATE, (const double[3]){.7, .5, .5}, CEILING, y));
        hidden += through;
        open += !through;
    }
    ck_assert_uint_gt(hidden, 100);
    ck_assert_uint_gt(open, 100);
    visibility_destroy(v);
    mesh_free(&m);
}
END_TEST

/* Down to a billionth of the edge from the corner, where lifted ends lie below the other's plane. */
START_TEST(nothing_blocks_in_a_corner) {
    const double leans[3] = {0, .8, -.8};
    mesh m = corner_with_plate(leans[_i], 0);
    visibility *v = NULL;
    lam_error error = {0};
    ck_assert_msg(visibility_create(&m, &v, &error) == LAM_OK, "%s", error.message);
    uint64_t seed = 4;
    for (int k = 0; k < 4000; k++) {
        const double near = pow(10, -9 * random_unit(&seed)), far = pow(10, -9 * random_unit(&seed));
        const double x[3] = {.3 * near, .05 + .9 * random_unit(&seed), 0},
                     y[3] = {leans[_i] * .4 * far, .05 + .9 * random_unit(&seed), .4 * far};
        ck_assert_msg(!is_blocked(v, FLOOR, x, WALL, y), "from %g to %g", x[0], y[2]);
        ck_assert_msg(!is_blocked(v, WALL, y, FLOOR, x), "to %g from %g", x[0], y[2]);
    }
    visibility_destroy(v);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("affine_segments");
    TCase *cases = tcase_create("segments");
    tcase_add_loop_test(cases, eight_segments_are_as_one, 0, 9);
    tcase_add_test(cases, a_segment_of_no_length_has_no_kernel);
    tcase_add_loop_test(cases, only_what_stands_between_blocks, 0, 3);
    tcase_add_loop_test(cases, nothing_blocks_in_a_corner, 0, 3);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
