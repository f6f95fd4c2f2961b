/* Unoccluded form factors by quadrature, against published closed forms. */
#include "solver/base/vector3.h"
#include "solver/formfactor/exchange/pair_factor.h"
#include "support/polygon_corners.h"
#include "support/suite.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* [x0, x1] x [y0, y1] at height z, facing up or down. */
static polygon level(double x0, double x1, double y0, double y1, double z, bool up) {
    if (up)
        return polygon_of_corners(4,
                                  (const double[4][3]){{x0, y0, z}, {x1, y0, z}, {x1, y1, z}, {x0, y1, z}});
    return polygon_of_corners(4, (const double[4][3]){{x0, y0, z}, {x0, y1, z}, {x1, y1, z}, {x1, y0, z}});
}

/* A wall in the plane x = at, y in [y0, y1], z in [z0, z1], facing +x. */
static polygon wall(double at, double y0, double y1, double z0, double z1) {
    return polygon_of_corners(4,
                              (const double[4][3]){{at, y0, z0}, {at, y1, z0}, {at, y1, z1}, {at, y0, z1}});
}

static double form_factor(const polygon *a, const polygon *b) {
    pair_factor_rules rules;
    pair_factor_rules_init(&rules);
    return pair_factor_exchange(&rules, a, b, 1e-8) / polygon_area(a);
}

/* The figures have twelve digits behind the point; eight digits are promised. */
static void check(const char *name, double found, double exact) {
    ck_assert_msg(fabs(found - exact) <= 1e-8 * exact + 1e-12, "%s: %.12f, must be %.12f", name, found,
                  exact);
}

START_TEST(parallel_rectangles) {
    const struct {
        double width, F;
    } opposed[] = {{1, .199824895698}, {2, .415253283577}, {.1, .003162056839}, {10, .826994522397}};
    for (size_t c = 0; c < sizeof opposed / sizeof *opposed; c++) {
        const polygon low = level(0, opposed[c].width, 0, opposed[c].width, 0, true);
        const polygon high = level(0, opposed[c].width, 0, opposed[c].width, 1, false);
        check("opposed", form_factor(&low, &high), opposed[c].F);
        check("opposed", form_factor(&high, &low), opposed[c].F);
    }
    const polygon square = level(0, 1, 0, 1, 0, true), beside = level(1, 2, 0, 1, 1, false),
                  wide = level(-.5, 1.5, -.5, 1.5, 1, false);
    check("beside", form_factor(&square, &beside), .086050489152);
    check("wide", form_factor(&square, &wide), .517653079516);
}
END_TEST

START_TEST(perpendicular_rectangles) {
    /* C-14 with a common edge of length 1: floor of width w, wall of height h. */
    const struct {
        double h, w, F;
    } cases[] = {
        {1, 1, .200043776075}, {2, 1, .232852602795}, {1, .1, .432513694007}, {.5, .5, .240636006177}};
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        const polygon floor = level(0, cases[c].w, 0, 1, 0, true), side = wall(0, 0, 1, 0, cases[c].h);
        check("common edge", form_factor(&floor, &side), cases[c].F);
    }
    const polygon floor = level(0, 1, 0, 1, 0, true), shifted = wall(0, 1, 2, 0, 1),
                  gap = level(1, 2, 0, 1, 0, true), side = wall(0, 0, 1, 0, 1);
    check("touching in a point", form_factor(&floor, &shifted), .040592230102);
    check("gap", form_factor(&gap, &side), .032808826720);
}
END_TEST

START_TEST(hinged_squares) {
    const struct {
        double degrees, F;
    } cases[] = {{30, .619028323}, {60, .370905321150}, {120, .086615001118}};
    for (size_t c = 0; c < 3; c++) {
        const double angle = cases[c].degrees * acos(-1) / 180, x = cos(angle), z = sin(angle);
        const polygon floor = level(0, 1, 0, 1, 0, true);
        const polygon leaf =
            polygon_of_corners(4, (const double[4][3]){{0, 0, 0}, {0, 1, 0}, {x, 1, z}, {x, 0, z}});
        /* The first has nine digits only. */
        ck_assert_double_eq_tol(form_factor(&floor, &leaf), cases[c].F, 1e-8 * cases[c].F + 5e-10);
        ck_assert_double_eq_tol(form_factor(&leaf, &floor), cases[c].F, 1e-8 * cases[c].F + 5e-10);
    }
}
END_TEST

START_TEST(triangles) {
    const polygon low = polygon_of_corners(3, (const double[3][3]){{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
    const polygon above = polygon_of_corners(3, (const double[3][3]){{0, 0, 1}, {0, 1, 1}, {1, 0, 1}});
    const polygon rest = polygon_of_corners(3, (const double[3][3]){{1, 0, 1}, {0, 1, 1}, {1, 1, 1}});
    check("above", form_factor(&low, &above), .115049228150);
    check("complement", form_factor(&low, &rest), .084775667549);

    /* A regular tetrahedron seen from inside: each face sees the other three alike. */
    const double corner[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    polygon face[4];
    for (int f = 0; f < 4; f++) {
        double of_face[3][3];
        for (int k = 0, at = 0; k < 4; k++)
            if (k != f) memcpy(of_face[at++], corner[k], sizeof of_face[0]);
        face[f] = polygon_of_corners(3, (const double(*)[3])of_face);
        double towards = 0;
        for (int d = 0; d < 3; d++) towards += face[f].normal[d] * (corner[f][d] - face[f].corner[0][d]);
        if (towards < 0) { /* turn it round */
            memcpy(of_face[0], face[f].corner[1], sizeof of_face[0]);
            memcpy(of_face[1], face[f].corner[0], sizeof of_face[0]);
            face[f] = polygon_of_corners(3, (const double(*)[3])of_face);
        }
    }
    for (int f = 0; f < 4; f++)
        for (int g = 0; g < 4; g++)
            if (f != g) check("tetrahedron", form_factor(&face[f], &face[g]), 1. / 3);
}
END_TEST

START_TEST(room_and_small_elements) {
    const polygon floor = level(0, 10, 0, 6, 0, true), ceiling = level(0, 10, 0, 6, 3, false),
                  end = wall(0, 0, 6, 0, 3);
    check("ceiling", form_factor(&floor, &ceiling), .488700936440);
    check("end", form_factor(&floor, &end), .093262176853);
    /* dA: the factor from a small element differs from that of a point by the square of its width. */
    const double w = 1e-6;
    const polygon square = level(0, 1, 0, 1, 1, false), corner = level(-w / 2, w / 2, -w / 2, w / 2, 0, true),
                  centre = level(.5 - w / 2, .5 + w / 2, .5 - w / 2, .5 + w / 2, 0, true);
    check("corner", form_factor(&corner, &square), .138531605995);
    check("centre", form_factor(&centre, &square), .239456470461);
}
END_TEST

START_TEST(what_is_behind_is_not_seen) {
    const polygon floor = level(0, 1, 0, 1, 0, true), low = level(0, 1, 0, 1, -1, true),
                  away = level(0, 1, 0, 1, 1, true), same = level(2, 3, 0, 1, 0, true);
    ck_assert_double_eq(form_factor(&floor, &low), 0);
    ck_assert_double_eq(form_factor(&floor, &away), 0);
    ck_assert_double_eq(form_factor(&floor, &same), 0); /* in the same plane */
    /* A wall that goes through the floor's plane is seen above it only. */
    const polygon through = wall(0, 0, 1, -1, 1);
    check("through", form_factor(&floor, &through), .200043776075);
}
END_TEST

/* Distances from touching to far, along which the methods change: the halves of a polygon sum to the whole,
 * which neither method knows of, and both directions agree. */
START_TEST(halves_sum_to_the_whole) {
    pair_factor_rules rules;
    pair_factor_rules_init(&rules);
    /* Skew, so that no edges are parallel. */
    const double low[4][3] = {{0, 0, 0}, {1, .1, 0}, {1.2, 1.1, 0}, {-.1, .9, 0}};
    const double high[3][3] = {{0, .1, .2}, {.3, 1, .25}, {1, .2, .9}};
    for (double gap = 0; gap < 300; gap = gap * 2 + (_i == 0 ? 1e-6 : 1e-3)) {
        double moved[3][3], one[3][3], two[3][3];
        memcpy(moved, high, sizeof moved);
        for (int c = 0; c < 3; c++) moved[c][2] += gap - .2;
        memcpy(one, moved, sizeof one);
        memcpy(two, moved, sizeof two);
        for (int d = 0; d < 3; d++) one[2][d] = two[1][d] = .37 * moved[1][d] + .63 * moved[2][d];
        const polygon a = polygon_of_corners(4, low),
                      whole = polygon_of_corners(3, (const double(*)[3])moved),
                      first = polygon_of_corners(3, (const double(*)[3])one),
                      second = polygon_of_corners(3, (const double(*)[3])two);
        const double g = pair_factor_exchange(&rules, &a, &whole, 1e-8);
        const double parts =
            pair_factor_exchange(&rules, &a, &first, 1e-8) + pair_factor_exchange(&rules, &a, &second, 1e-8);
        ck_assert_msg(g > 0 && fabs(parts - g) <= 2e-8 * g, "gap %g: %.12g, halves %.12g", gap, g, parts);
        const double back = pair_factor_exchange(&rules, &whole, &a, 1e-8);
        ck_assert_msg(fabs(back - g) <= 2e-8 * g, "gap %g: %.12g, back %.12g", gap, g, back);
    }
}
END_TEST

/* Double integral of ln r^2 over two edges, slowly: a closed form over the second, and over the first 8 Gauss
 * nodes on each of many intervals, which halve towards its ends and the places where it is nearest to the
 * line of the second and to its ends. The last are 2^-40 of the whole, which leaves 1e-12 of it. */
static double slow_edges(const pair_factor_rules *rules, const double *from, const double *to,
                         const double *other_from, const double *other_to) {
    enum { RULE = 5, LEVELS = 40 };
    const gauss_rule *g = &rules->gauss[RULE];
    double along[3], other[3], v[3], places[5] = {0, 1};
    int n = 2;
    subtract3(to, from, along);
    subtract3(other_to, other_from, other);
    subtract3(other_from, from, v);
    const double own = dot3(along, along), across = dot3(other, other), both = dot3(along, other);
    const double candidates[3] = {dot3(v, along) / own, (dot3(v, along) + both) / own,
                                  (dot3(v, along) * across - dot3(v, other) * both) /
                                      (own * across - both * both)};
    for (int c = 0; c < 3; c++) {
        int at = n;
        if (!(candidates[c] > 1e-12 && candidates[c] < 1 - 1e-12)) continue;
        for (; places[at - 1] > candidates[c]; at--) places[at] = places[at - 1];
        places[at] = candidates[c];
        n++;
    }
    double sum = 0;
    for (int piece = 0; piece + 1 < n; piece++)
        for (int k = -LEVELS; k < LEVELS; k++) {
            const double width = places[piece + 1] - places[piece];
            const double low = k == -LEVELS ? 0 : k < 0 ? ldexp(1, k - 1) : 1 - ldexp(1, -k - 1);
            const double high = k < 0 ? ldexp(1, k) : k + 1 == LEVELS ? 1 : 1 - ldexp(1, -k - 2);
            for (int q = 0; q < g->n; q++) {
                const double s = places[piece] + width * (low + (high - low) * g->node[q]);
                double r[3];
                for (int d = 0; d < 3; d++) r[d] = from[d] + s * along[d] - other_from[d];
                const double length = sqrt(across), a = dot3(r, other) / length, b = length - a;
                for (int d = 0; d < 3; d++) r[d] -= a * other[d] / length;
                const double h = sqrt(dot3(r, r)), from2 = a * a + h * h, to2 = b * b + h * h;
                sum += g->weight[q] * width * (high - low) *
                       ((to2 > 0 ? b * log(to2) : 0) + (from2 > 0 ? a * log(from2) : 0) - 2 * length +
                        2 * h * atan2(h * length, h * h - a * b));
            }
        }
    return sum * sqrt(own);
}

/* A_a F_ab by the contour integral, slowly; terms: sum of the magnitudes of its terms, whose rounding it has.
 */
static double slow_exchange(const pair_factor_rules *rules, const polygon *one, const polygon *two,
                            double *terms) {
    polygon a, b;
    double sum = 0;
    *terms = 0;
    polygon_in_front(one, two, &a);
    polygon_in_front(two, one, &b);
    for (int i = 0; i < a.n; i++)
        for (int j = 0; j < b.n; j++) {
            const double *const ends[4] = {a.corner[i], a.corner[(i + 1) % a.n], b.corner[j],
                                           b.corner[(j + 1) % b.n]};
            double u[3], v[3];
            subtract3(ends[1], ends[0], u);
            subtract3(ends[3], ends[2], v);
            if (!(dot3(u, u) > 0 && dot3(v, v) > 0)) continue;
            const double cosine = dot3(u, v) / sqrt(dot3(u, u) * dot3(v, v));
            /* The grading above takes the nearest point of lines, which parallel ones lack. */
            const double term =
                cosine == 0 ? 0 : cosine * slow_edges(rules, ends[0], ends[1], ends[2], ends[3]);
            sum += term / (4 * acos(-1));
            *terms += fabs(term);
        }
    return sum;
}

/* The corners of a triangle beside another one. */
typedef struct neighbour_case {
    const char *name;
    double corner[3][3];
} neighbour_case;

/* Triangles that share an edge, nearly flat as in a fine bowl or folded, that share a corner, that meet in
 * a corner and the middle of an edge, that cross the other's plane, and that are near, with edges that are
 * nearly parallel: against a slow integral, to the tolerance. */
START_TEST(near_pairs_keep_the_tolerance) {
    static const double flat[3][3] = {{0, 0, 0}, {1, 0, 0}, {.3, .9, 0}};
    static const neighbour_case cases[] = {
        {"edge, nearly flat", {{1, 0, 0}, {0, 0, 0}, {.6, -.8, .02}}},
        {"edge, very flat", {{1, 0, 0}, {0, 0, 0}, {.6, -.8, 3e-4}}},
        {"edge, upright", {{1, 0, 0}, {0, 0, 0}, {.4, 0, .9}}},
        {"edge, folded", {{1, 0, 0}, {0, 0, 0}, {.4, .8, .2}}},
        {"edge, narrow", {{1, 0, 0}, {0, 0, 0}, {.98, -.03, .01}}},
        {"corner", {{0, 0, 0}, {-.9, .2, .3}, {-.3, -.8, .4}}},
        {"corner, nearly flat", {{1, 0, 0}, {1.2, -.9, .03}, {1.9, .1, .02}}},
        {"corner in an edge", {{.45, 0, 0}, {.1, -.9, .5}, {.9, -.7, .6}}},
        {"crossing", {{1.2, 0, -.4}, {1.4, .9, .3}, {1.3, -.5, .8}}},
        {"near", {{.2, -.05, .02}, {.8, -.06, .03}, {.5, -.7, .2}}},
        {"above", {{.1, .1, .05}, {.3, .7, .06}, {.9, .2, .07}}},
        {"parallel but for .03", {{.97, -.1, .01}, {.0, -.13, .012}, {.5, -.8, .1}}},
        {"parallel but for .002", {{1, -.1, .02}, {0, -.102, .02}, {.5, -.8, .1}}},
        {"parallel but for 5e-4", {{1, -.1, .02}, {0, -.1005, .02}, {.5, -.8, .1}}},
        {"parallel but for 1e-5", {{1, -.1, .02}, {0, -.10001, .02}, {.5, -.8, .1}}},
        {"parallel but for 1e-9", {{1, -.1, .02}, {0, -.100000001, .02}, {.5, -.8, .1}}},
    };
    pair_factor_rules rules;
    pair_factor_rules_init(&rules);
    const polygon a = polygon_of_corners(3, flat);
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        polygon b = polygon_of_corners(3, cases[k].corner);
        if (dot3(b.normal, a.centre) < dot3(b.normal, b.centre)) {
            double turned[3][3];
            for (int c = 0; c < 3; c++) memcpy(turned[c], cases[k].corner[2 - c], sizeof turned[c]);
            b = polygon_of_corners(3, (const double(*)[3])turned);
        }
        double terms;
        const double slow = slow_exchange(&rules, &a, &b, &terms);
        ck_assert_double_gt(slow, 0);
        for (double tolerance = 1e-8; tolerance < .1; tolerance *= 100) {
            const double found = pair_factor_exchange(&rules, &a, &b, tolerance),
                         back = pair_factor_exchange(&rules, &b, &a, tolerance);
            /* Some dozen roundings of each of the terms. */
            const double allowed = tolerance * slow + 12 * DBL_EPSILON * terms;
            ck_assert_msg(fabs(found - slow) <= allowed, "%s: %.12g, slowly %.12g, tolerance %g",
                          cases[k].name, found, slow, tolerance);
            ck_assert_msg(fabs(back - slow) <= allowed, "%s: back %.12g, slowly %.12g, tolerance %g",
                          cases[k].name, back, slow, tolerance);
        }
    }
}
END_TEST

/* The halves fill the polygon, and the areas that its points stand for sum to its own: by the midpoint
 * rule, which is exact for areas linear in u and w, as those of a bilinear quad are. */
START_TEST(pieces_and_points_fill_the_polygon) {
    const polygon shapes[2] = {
        polygon_of_corners(4, (const double[4][3]){{0, 0, 0}, {1, .1, 0}, {1.2, 1.1, 0}, {-.1, .6, 0}}),
        polygon_of_corners(3, (const double[3][3]){{0, 0, 0}, {2, .1, 0}, {.3, 1.1, 0}})};
    enum { GRID = 8 };
    for (int s = 0; s < 2; s++) {
        const double area = polygon_area(&shapes[s]);
        polygon halves[2];
        double of_halves = 0, of_points = 0;
        polygon_halve(&shapes[s], halves);
        for (int h = 0; h < 2; h++) {
            polygon turned = halves[h];
            polygon_measure(&turned);
            ck_assert_double_eq_tol(turned.normal[2], 1, 1e-12);
            ck_assert_double_lt(turned.radius, .9 * shapes[s].radius);
            of_halves += polygon_area(&halves[h]);
        }
        for (int i = 0; i < GRID; i++)
            for (int j = 0; j < GRID; j++) {
                double point[3];
                of_points +=
                    polygon_point(&shapes[s], (i + .5) / GRID, (j + .5) / GRID, point) / (GRID * GRID);
            }
        ck_assert_double_eq_tol(of_halves, area, 1e-12);
        ck_assert_double_eq_tol(of_points, area, 1e-12);
    }
}
END_TEST

/* F does not depend on the unit of length nor on the place. */
START_TEST(scale_and_place) {
    const double scales[] = {1e-3, 1, 1e5}, places[] = {0, 1e6};
    for (int s = 0; s < 3; s++)
        for (int p = 0; p < 2; p++) {
            const double k = scales[s], x = places[p] * k;
            const polygon low = level(x, x + k, x, x + k, x, true),
                          high = level(x, x + k, x, x + k, x + k, false);
            /* The corners themselves are rounded there: by 1e-10 of the width, and F with them. */
            ck_assert_double_eq_tol(form_factor(&low, &high), .199824895698, 1e-8);
        }
}
END_TEST

int main(void) {
    Suite *suite = suite_create("pair");
    TCase *cases = tcase_create("pair");
    tcase_add_test(cases, parallel_rectangles);
    tcase_add_test(cases, perpendicular_rectangles);
    tcase_add_test(cases, hinged_squares);
    tcase_add_test(cases, triangles);
    tcase_add_test(cases, room_and_small_elements);
    tcase_add_test(cases, what_is_behind_is_not_seen);
    tcase_add_loop_test(cases, halves_sum_to_the_whole, 0, 2);
    tcase_add_test(cases, near_pairs_keep_the_tolerance);
    tcase_add_test(cases, pieces_and_points_fill_the_polygon);
    tcase_add_test(cases, scale_and_place);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
