/* Visible shares by lines, against the same shares by grids of points, one segment after the other in double.
 */
#include "solver/base/random.h"
#include "solver/base/vector3.h"
#include "solver/formfactor/sight/visible_lines.h"
#include "solver/formfactor/visibility/sample.h"
#include "support/polygon_corners.h"
#include "support/suite.h"

#include <math.h>

static const double centre[3] = {.7, -.3, .2}; /* of the recentred coordinates */

/* An edge is inside where its distance is above 0, as seen against the normal. */
static segment_occluder occluder_of(const polygon *p) {
    segment_occluder o = {.n = p->n,
                          .level = (float)(dot3(p->normal, p->corner[0]) - dot3(p->normal, centre))};
    for (int d = 0; d < 3; d++) o.normal[d] = (float)p->normal[d];
    for (int e = 0; e < p->n; e++) {
        double along[3], inwards[3];
        subtract3(p->corner[(e + 1) % p->n], p->corner[e], along);
        cross3(p->normal, along, inwards);
        const double length = sqrt(dot3(inwards, inwards));
        for (int d = 0; d < 3; d++) o.edge[e][d] = (float)(inwards[d] / length);
        o.edge[e][3] = (float)((dot3(inwards, centre) - dot3(inwards, p->corner[e])) / length);
    }
    return o;
}

static bool blocks(const polygon *o, const double x[3], const double y[3]) {
    double at[3], from[3], to[3];
    subtract3(x, o->corner[0], from);
    subtract3(y, o->corner[0], to);
    const double f = dot3(o->normal, from), g = dot3(o->normal, to);
    if (f * g >= 0) return false;
    for (int d = 0; d < 3; d++) at[d] = x[d] + f / (f - g) * (y[d] - x[d]);
    for (int e = 0; e < o->n; e++) {
        double along[3], inwards[3], r[3];
        subtract3(o->corner[(e + 1) % o->n], o->corner[e], along);
        cross3(o->normal, along, inwards);
        subtract3(at, o->corner[e], r);
        if (dot3(inwards, r) < 0) return false;
    }
    return true;
}

/* sum K V / sum K over GRID^2 points of each. *facing: the share of all pairs of points that face each other.
 */
static double share_by_points(const polygon *a, const polygon *b, int n_shades, const polygon *shades,
                              double *facing) {
    enum { GRID = 40 };
    double seen = 0, all = 0, in_front = 0;
    for (int k = 0; k < GRID * GRID; k++)
        for (int l = 0; l < GRID * GRID; l++) {
            double x[3], y[3], r[3];
            /* Points of b are moved from one point of a to the next, so that no shadow moves in steps. */
            const double shift = fmod(.618034 * k, 1) / GRID, other = fmod(.754878 * k, 1) / GRID;
            const double area =
                polygon_point(a, (k % GRID + .5) / GRID, (k / GRID + .5) / GRID, x) *
                polygon_point(b, l % GRID / (double)GRID + shift, l / GRID / (double)GRID + other, y);
            subtract3(y, x, r);
            const double leaving = dot3(r, a->normal), arriving = -dot3(r, b->normal), r2 = dot3(r, r);
            if (leaving <= 0 || arriving <= 0) continue;
            const double K = area * leaving * arriving / (r2 * r2);
            bool blocked = false;
            for (int o = 0; o < n_shades && !blocked; o++) blocked = blocks(&shades[o], x, y);
            in_front++;
            all += K;
            if (!blocked) seen += K;
        }
    *facing = in_front / ((double)GRID * GRID * GRID * GRID);
    return seen / all;
}

static line_sums sums_of_lines(const segment_occluder *of, segment_list *list, const line_pair *lines,
                               uint64_t seed, uint32_t n) {
    line_sums sums = {0, 0};
    pair_sampler sampler;
    pair_sampler_init(&sampler, seed, 1, 2);
    for (uint32_t first = 0; first < n; first += VISIBLE_LINES) {
        double x[4][VISIBLE_LINES];
        pair_sampler_packet(&sampler, first, x);
        visible_lines_add(of, list, lines, centre, (const double(*)[VISIBLE_LINES])x, &sums);
    }
    return sums;
}

static const double floor_square[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}},
                    ceiling[4][3] = {{.2, 0, 1.3}, {.2, 1.2, 1.3}, {1.5, 1.2, 1.3}, {1.5, 0, 1.3}},
                    /* Half of it is behind the plane of the floor. */
    wall[4][3] = {{1.4, 0, -.6}, {1.4, 0, .8}, {1.4, 1.1, .8}, {1.4, 1.1, -.6}},
                    /* The same from another corner on: its other side runs down. */
    wall_from_above[4][3] = {{1.4, 0, .8}, {1.4, 1.1, .8}, {1.4, 1.1, -.6}, {1.4, 0, -.6}},
                    floor_triangle[3][3] = {{0, 0, 0}, {1.2, .1, 0}, {.2, 1, 0}},
                    ceiling_triangle[3][3] = {{.2, 0, 1.3}, {.3, 1.2, 1.3}, {1.5, .1, 1.3}},
                    floor_trapezoid[4][3] = {{0, 0, 0}, {1.3, 0, 0}, {.8, 1, 0}, {.1, 1, 0}},
                    ceiling_trapezoid[4][3] = {{.2, 0, 1.3}, {.3, 1.2, 1.3}, {.9, 1, 1.3}, {1.5, 0, 1.3}};
/* Some in one another's shadow, on both sides, a sliver, one that hides nothing, and a triangle. */
static const double plates[][4][3] = {{{.4, -1, .5}, {3, -1, .5}, {3, .6, .5}, {.4, .6, .5}},
                                      {{.5, .3, .9}, {.5, .9, .9}, {.9, .9, .9}, {.9, .3, .9}},
                                      {{.1, .7, .4}, {.6, .7, .7}, {.6, .9, .7}, {.1, .9, .4}},
                                      {{.2, .2, .2}, {.25, .2, .2}, {.25, .9, .6}, {.2, .9, .6}},
                                      {{5, 5, .5}, {6, 5, .5}, {6, 6, .5}, {5, 6, .5}}};
enum { PLATES = sizeof plates / sizeof *plates };

typedef struct setting {
    polygon a, b, plates[PLATES];
    segment_occluder listed[PLATES];
    uint32_t of[PLATES];
    segment_list list;
    affine_map maps[2];
} setting;

/* Cases of shapes, and the first n plates from `first` on. */
static void setting_make(setting *s, int shapes, int first, int n) {
    const polygon floors[] = {polygon_of_corners(4, floor_square), polygon_of_corners(3, floor_triangle),
                              polygon_of_corners(4, floor_trapezoid)};
    const polygon others[] = {polygon_of_corners(4, ceiling), polygon_of_corners(3, ceiling_triangle),
                              polygon_of_corners(4, ceiling_trapezoid), polygon_of_corners(4, wall),
                              polygon_of_corners(4, wall_from_above)};
    s->a = floors[shapes % 3];
    s->b = others[shapes / 3];
    for (int k = 0; k < n; k++) {
        s->plates[k] = polygon_of_corners(4, plates[first + k]);
        s->listed[k] = occluder_of(&s->plates[k]);
        s->of[k] = (uint32_t)k;
    }
    s->list = (segment_list){.count = n, .of = s->of};
    s->maps[0] = affine_map_of(&s->a);
    s->maps[1] = affine_map_of(&s->b);
}

/* The four ways that lines can run; false for lines across a quad that is none of their kind. */
static bool lines_of(const setting *s, int way, line_pair *out) {
    const affine_map *from = &s->maps[1 - way / 2], *to = &s->maps[way / 2];
    *out = (line_pair){{*from, *to}, way % 2};
    return !to->twisted;
}

/* Pairs of shapes, all of them; a sanitizer watches the same code with each shape once. */
#ifdef LAMBERT_FEW_CASES
enum { PAIRS = 5 };
static int pair_of_shapes(int k) {
    return 3 * k + k % 3;
}
#else
enum { PAIRS = 15 };
static int pair_of_shapes(int k) {
    return k;
}
#endif

/* With any shapes, occluders and lines, so many lines come to the share of the grid, which is off by some
 * thousandths itself; no more is in front than the grid finds. */
START_TEST(lines_see_what_points_see) {
    static const int numbers[][2] = {{0, 0}, {0, 1}, {1, 1}, {0, 2}, {2, 1}, {0, 5}, {3, 1}};
    for (size_t k = 0; k < sizeof numbers / sizeof *numbers; k++) {
        setting s;
        double facing;
        setting_make(&s, pair_of_shapes(_i), numbers[k][0], numbers[k][1]);
        const double exact = share_by_points(&s.a, &s.b, s.list.count, s.plates, &facing);
        if (numbers[k][1] == 0) ck_assert_double_eq(exact, 1);
        for (int way = 0; way < 4; way++) {
            line_pair lines;
            if (!lines_of(&s, way, &lines)) continue;
            const line_sums sums = sums_of_lines(s.listed, &s.list, &lines, 3, 8192);
            ck_assert_double_eq_tol(sums.seen / sums.all, exact, .003);
        }
    }
}
END_TEST

/* int K dt over the lines x, point by point. */
static double integral_of(const polygon *a, const polygon *b, const line_pair *p,
                          const double x[3][VISIBLE_LINES]) {
    enum { STEPS = 20000 };
    double sum = 0;
    for (int k = 0; k < VISIBLE_LINES; k++)
        for (int step = 0; step < STEPS; step++) {
            double from[3], to[3], r[3];
            const double t = (step + .5) / STEPS;
            polygon_point(a, x[0][k], x[1][k], from);
            for (int d = 0; d < 3; d++)
                to[d] = p->maps.to.corner[d] + x[2][k] * p->maps.to.side[1 - p->along][d] +
                        t * p->maps.to.side[p->along][d];
            subtract3(to, from, r);
            const double leaving = dot3(r, a->normal), arriving = -dot3(r, b->normal), r2 = dot3(r, r);
            if (leaving > 0 && arriving > 0) sum += leaving * arriving / (r2 * r2) / STEPS;
        }
    return sum;
}

/* The squares touch, are a hundredth or a room apart, or are seen from far away, where the kernel is that of
 * the middle; some are near the change from the one form to the other. */
START_TEST(integrals_of_lines_are_exact) {
    static const double distance[] = {0, .01, 1, 30, 900, 1100, 1e5};
    uint64_t seed = 11;
    for (size_t k = 0; k < sizeof distance / sizeof *distance; k++)
        for (int upright = 0; upright < 2; upright++) {
            const double z = distance[k];
            const double across[4][3] = {{0, 0, z}, {0, 1, z}, {1, 1, z}, {1, 0, z}},
                         beside[4][3] = {{1 + z, 0, -.3}, {1 + z, 0, 1}, {1 + z, 1, 1}, {1 + z, 1, -.3}};
            if (z == 0 && !upright) continue;
            const polygon a = polygon_of_corners(4, floor_square),
                          b = polygon_of_corners(4, upright ? beside : across);
            segment_list none = {.count = 0};
            line_pair lines = {{affine_map_of(&a), affine_map_of(&b)}, 0};
            for (lines.along = 0; lines.along < 2; lines.along++) {
                double x[3][VISIBLE_LINES];
                line_sums sums = {0, 0};
                for (int line = 0; line < VISIBLE_LINES; line++)
                    for (int d = 0; d < 3; d++) x[d][line] = random_unit(&seed);
                visible_lines_add(NULL, &none, &lines, centre, (const double(*)[VISIBLE_LINES])x, &sums);
                ck_assert_double_eq(sums.seen, sums.all);
                const double exact = integral_of(&a, &b, &lines, (const double(*)[VISIBLE_LINES])x);
                ck_assert_double_eq_tol(sums.all / exact, 1, 1e-5);
            }
        }
}
END_TEST

/* Plates that hide all of a shape together, one alone, and none. */
START_TEST(all_and_nothing_are_exact) {
    setting s;
    line_pair lines;
    setting_make(&s, 0, 0, 0);
    const double whole[4][3] = {{-3, -3, .5}, {3, -3, .5}, {3, 3, .5}, {-3, 3, .5}};
    const double halves[2][4][3] = {{{-3, -3, .5}, {.7, -3, .5}, {.7, 3, .5}, {-3, 3, .5}},
                                    {{.7, -3, .5}, {3, -3, .5}, {3, 3, .5}, {.7, 3, .5}}};
    const polygon shapes[] = {polygon_of_corners(4, halves[0]), polygon_of_corners(4, whole),
                              polygon_of_corners(4, halves[1]), polygon_of_corners(4, plates[4])};
    segment_occluder listed[4];
    uint32_t of[4] = {0, 2, 3, 1};
    for (int k = 0; k < 4; k++) listed[k] = occluder_of(&shapes[k]);
    for (int way = 0; way < 4; way++) {
        segment_list list = {.count = 2, .of = of};
        ck_assert(lines_of(&s, way, &lines));
        line_sums sums = sums_of_lines(listed, &list, &lines, 7, 64);
        ck_assert_double_gt(sums.all, 0);
        ck_assert_double_lt(sums.seen, 1e-6 * sums.all); /* a seam of rounding is left */
        list = (segment_list){.count = 1, .of = (uint32_t[]){3}};
        sums = sums_of_lines(listed, &list, &lines, 7, 64);
        ck_assert_double_eq(sums.seen, sums.all);
        uint32_t both[2] = {3, 1};
        list = (segment_list){.count = 2, .of = both};
        sums = sums_of_lines(listed, &list, &lines, 7, 64);
        ck_assert_double_eq(sums.seen, 0);
        ck_assert_uint_eq(both[0], 1); /* the one that hides all is asked first */
    }
    /* Behind each other there is nothing, seen or not. */
    const affine_map down = s.maps[0];
    lines = (line_pair){{down, affine_map_of(&(polygon){0})}, 0};
    const double below[4][3] = {{0, 0, -1}, {1, 0, -1}, {1, 1, -1}, {0, 1, -1}};
    const polygon b = polygon_of_corners(4, below);
    lines.maps.to = affine_map_of(&b);
    segment_list none = {.count = 0};
    const line_sums sums = sums_of_lines(NULL, &none, &lines, 7, 64);
    ck_assert_double_eq(sums.all, 0);
    ck_assert_double_eq(sums.seen, 0);
}
END_TEST

/* The order of the list changes nothing but rounding. */
START_TEST(order_does_not_count) {
    setting s;
    line_pair lines;
    setting_make(&s, 0, 0, PLATES);
    ck_assert(lines_of(&s, _i, &lines));
    const line_sums first = sums_of_lines(s.listed, &s.list, &lines, 9, 256);
    for (int k = 0; k < PLATES; k++) s.of[k] = (uint32_t)(PLATES - 1 - k);
    const line_sums last = sums_of_lines(s.listed, &s.list, &lines, 9, 256);
    ck_assert_double_eq_tol(first.seen / last.seen, 1, 1e-12);
}
END_TEST

/* A slit along an axis: lines that are chosen run across its shadow, and 16 of them err by less than
 * two thirds of what 16 lines along it do. Twisted quads have no lines, nor have long lists any. */
START_TEST(lines_run_across_shadows) {
    setting s;
    line_pair chosen;
    uint32_t of[LINE_OCCLUDERS_MOST + 1] = {0};
    segment_list list = {.count = 1, .of = of};
    setting_make(&s, 0, 0, 0);
    const double edge[2][4][3] = {{{.6, -5, .7}, {9, -5, .7}, {9, 9, .7}, {.6, 9, .7}},
                                  {{-5, .6, .7}, {9, .6, .7}, {9, 9, .7}, {-5, 9, .7}}};
    for (int axis = 0; axis < 2; axis++) {
        const polygon shape = polygon_of_corners(4, edge[axis]);
        const segment_occluder one = occluder_of(&shape);
        double facing, error[2] = {0, 0};
        const double exact = share_by_points(&s.a, &s.b, 1, &shape, &facing);
        ck_assert(line_pair_choose(&one, &list, &s.maps[0], &s.maps[1], centre, &chosen));
        const double *side = chosen.maps.to.side[chosen.along];
        ck_assert_double_gt(fabs(side[axis]), .5);
        for (int along = 0; along < 2; along++)
            for (uint64_t seed = 0; seed < 16; seed++) {
                const line_pair lines = {chosen.maps, along ? 1 - chosen.along : chosen.along};
                const line_sums sums = sums_of_lines(&one, &list, &lines, seed, 16);
                error[along] += pow(sums.seen / sums.all - exact, 2);
            }
        ck_assert_double_lt(sqrt(error[0]), 2. / 3 * sqrt(error[1]));
    }
    /* An edge through the middle counts for little where its occluder hardly reaches in from the side. */
    const double corner[4][3] = {{.69, -5, .7}, {9, -5, .7}, {9, .06, .7}, {.69, .06, .7}},
                 board[4][3] = {{-5, .8, .7}, {9, .8, .7}, {9, 9, .7}, {-5, 9, .7}};
    const polygon both[] = {polygon_of_corners(4, corner), polygon_of_corners(4, board)};
    const segment_occluder two[] = {occluder_of(&both[0]), occluder_of(&both[1])};
    of[1] = 1;
    list.count = 2;
    ck_assert(line_pair_choose(two, &list, &s.maps[0], &s.maps[1], centre, &chosen));
    ck_assert_double_gt(fabs(chosen.maps.to.side[chosen.along][1]), .5);
    list.count = LINE_OCCLUDERS_MOST + 1;
    ck_assert(!line_pair_choose(NULL, &list, &s.maps[0], &s.maps[1], centre, &chosen));
    setting_make(&s, 8, 0, 1);
    ck_assert(!line_pair_choose(s.listed, &s.list, &s.maps[0], &s.maps[1], centre, &chosen));
    setting_make(&s, 2, 0, 1);
    ck_assert(line_pair_choose(s.listed, &s.list, &s.maps[0], &s.maps[1], centre, &chosen));
    ck_assert(!chosen.maps.to.twisted);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("visible_lines");
    TCase *cases = tcase_create("lines");
    tcase_set_timeout(cases, 120);
    tcase_add_loop_test(cases, lines_see_what_points_see, 0, PAIRS);
    tcase_add_test(cases, integrals_of_lines_are_exact);
    tcase_add_test(cases, all_and_nothing_are_exact);
    tcase_add_loop_test(cases, order_does_not_count, 0, 4);
    tcase_add_test(cases, lines_run_across_shadows);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
