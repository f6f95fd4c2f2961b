/* Direct light by segments against closed forms, far from the light and nearly touching it, and directions in
 * spherical triangles. */
#include "solver/base/random.h"
#include "solver/walk/direct_light.h"
#include "solver/walk/spherical_triangle.h"
#include "support/box.h"
#include "support/dense.h"
#include "support/scene.h"
#include "support/suite.h"

static const double unit[3] = {1, 1, 1};
enum { DIVISIONS = 4, POSITIONS = 4, SEEDS = 100 };

/* Squares of a quarter of a side that look down on the floor, from far to nearly touching, the last one
 * beside a wall too. */
static const double moves[POSITIONS][3] = {{.3, .3, .75}, {.4, .3, .1}, {.4, .35, .004}, {.002, .3, .02}};

static moving_light square_light(void) {
    static const double corners[4][3] = {{0, 0, 0}, {0, .25, 0}, {.25, .25, 0}, {.25, 0, 0}};
    moving_light l;
    lam_error error = {.message = ""};
    double(*corner)[3] = test_allocate(4, sizeof *corner);
    memcpy(corner, corners, sizeof corners);
    ck_ok(moving_light_create(4, corner, &l, &error));
    l.n = POSITIONS;
    l.pose = test_allocate(POSITIONS, sizeof *l.pose);
    for (size_t k = 0; k < POSITIONS; k++) {
        l.pose[k].name = strdup("a position");
        memcpy(l.pose[k].move, moves[k], sizeof moves[k]);
        for (int d = 0; d < 3; d++) l.pose[k].turn[d][d] = 1;
    }
    return l;
}

static double exact(const mesh *m, size_t i, size_t k) {
    const box_cell cell = box_cell_of(unit, DIVISIONS, i);
    box_cell light = {.axis = 2, .level = moves[k][2]};
    for (int d = 0; d < 3; d++) {
        light.from[d] = moves[k][d];
        light.to[d] = moves[k][d] + (d == 2 ? 0 : .25);
    }
    if (cell.axis == 2 && cell.level > light.level) return 0;
    if (cell.axis == 2) return box_exchange(&cell, &light) / m->area[i];
    if (cell.from[2] >= light.level) return 0;
    box_cell below = cell; /* of a wall, the part below the light */
    below.to[2] = fmin(cell.to[2], light.level);
    return box_exchange(&below, &light) / m->area[i];
}

/* Over seeds the squared error is what is stated, and the mean is right within 4.5 standard errors of it:
 * floors, walls that the plane of the light cuts, and what is behind it, which is exactly 0. */
START_TEST(agrees_with_closed_forms) {
    mesh m = box_mesh(unit, DIVISIONS, .5f);
    moving_light l = square_light();
    lam_error error = {.message = ""};
    walk_scene *scene = NULL;
    const size_t size = m.n * POSITIONS;
    float *F = test_allocate(size, sizeof *F), *variance = test_allocate(size, sizeof *variance);
    double *sum = test_allocate(size, sizeof *sum), *squares = test_allocate(size, sizeof *squares);
    double off[POSITIONS] = {0}, stated[POSITIONS] = {0}, all[POSITIONS] = {0};
    ck_ok(walk_scene_create(&m, CLOSURE_MEASURED, &scene, &error));
    for (uint64_t seed = 1; seed <= SEEDS; seed++) {
        const direct_light_problem problem = {.light = &l, .samples = 64, .seed = random_hash(seed)};
        ck_ok(walk_direct_light(scene, &problem, F, variance, &error));
        for (size_t at = 0; at < size; at++) {
            const size_t k = at % POSITIONS;
            const double truth = exact(&m, at / POSITIONS, k), miss = (double)F[at] - truth;
            if (truth == 0) ck_assert(F[at] == 0 && variance[at] == 0);
            off[k] += miss * miss;
            stated[k] += (double)variance[at];
            all[k] += truth * truth;
            sum[at] += miss / SEEDS;
            squares[at] += miss * miss / SEEDS;
        }
    }
    for (size_t k = 0; k < POSITIONS; k++) {
        /* Of the last position few points of the walls see any light, so that a few seeds have all the error.
         */
        const double factor = k == 3 ? 3 : 1.6;
        ck_assert_msg(off[k] * factor > stated[k] && off[k] < factor * stated[k], "position %zu: %g for %g",
                      k, off[k], stated[k]);
        ck_assert_msg(off[k] < 4e-4 * all[k], "position %zu: %g of %g", k, off[k], all[k]);
    }
    for (size_t at = 0; at < size; at++) {
        const double spread = sqrt(fmax(squares[at] - sum[at] * sum[at], 0) / (SEEDS - 1));
        ck_assert_msg(fabs(sum[at]) <= 4.5 * spread + 2e-6, "element %zu, position %zu: %g +- %g",
                      at / POSITIONS, at % POSITIONS, sum[at], spread);
    }
    walk_scene_free(scene);
    free(F);
    free(variance);
    free(sum);
    free(squares);
    moving_light_free(&l);
    mesh_free(&m);
}
END_TEST

/* An octant, and a triangle whose vector sum of directions is known: half the sum over its sides of their
 * angle times the normal of their plane. */
START_TEST(directions_are_uniform) {
    static const double corners[3][3][3] = {{{2, 0, 0}, {0, 3, 0}, {0, 0, .5}},
                                            {{1, .2, .1}, {.9, .4, -.2}, {1.1, .1, .6}},
                                            {{.1, 0, .01}, {-.1, .3, .01}, {-.1, -.3, .01}}};
    static const double y[3] = {0, 0, 0};
    enum { SIDE = 300 };
    for (size_t s = 0; s < 3; s++) {
        spherical_triangle t;
        double mean[3] = {0, 0, 0}, wanted[3] = {0, 0, 0};
        spherical_triangle_set(y, corners[s][0], corners[s][1], corners[s][2], &t);
        if (s == 0) ck_assert_double_eq_tol(t.solid_angle, M_PI / 2, 1e-12);
        for (size_t k = 0; k < SIDE * SIDE; k++) {
            double out[3];
            spherical_triangle_direction(&t, (k % SIDE + .5) / SIDE, (k / SIDE + .5) / SIDE, out);
            ck_assert_double_eq_tol(out[0] * out[0] + out[1] * out[1] + out[2] * out[2], 1, 1e-9);
            for (int d = 0; d < 3; d++) mean[d] += out[d] / (SIDE * SIDE);
        }
        for (int side = 0; side < 3; side++) {
            const double *p = side == 0   ? t.a
                              : side == 1 ? t.b
                                          : t.c,
                         *q = side == 0   ? t.b
                              : side == 1 ? t.c
                                          : t.a;
            double n[3], size = 0, along = 0;
            for (int d = 0; d < 3; d++) {
                n[d] = p[(d + 1) % 3] * q[(d + 2) % 3] - p[(d + 2) % 3] * q[(d + 1) % 3];
                size += n[d] * n[d];
                along += p[d] * q[d];
            }
            for (int d = 0; d < 3; d++) wanted[d] += atan2(sqrt(size), along) * n[d] / sqrt(size) / 2;
        }
        const double sign = wanted[0] * mean[0] + wanted[1] * mean[1] + wanted[2] * mean[2] < 0 ? -1 : 1;
        for (int d = 0; d < 3; d++)
            ck_assert_msg(fabs(t.solid_angle * mean[d] - sign * wanted[d]) < 1e-4 * t.solid_angle,
                          "triangle %zu, %d: %g for %g", s, d, t.solid_angle * mean[d], sign * wanted[d]);
    }
}
END_TEST

START_TEST(thin_triangles_have_no_directions) {
    static const double y[3] = {0, 0, 0}, p[3] = {1, 0, 0}, q[3] = {1, 1, 0}, r[3] = {1, 2, 0};
    spherical_triangle t;
    spherical_triangle_set(y, p, q, r, &t);
    ck_assert_double_eq(t.solid_angle, 0);
    spherical_triangle_set(y, p, p, r, &t);
    ck_assert_double_eq(t.solid_angle, 0);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("direct light");
    TCase *tests = tcase_create("direct light");
    tcase_set_timeout(tests, 120);
    tcase_add_test(tests, agrees_with_closed_forms);
    tcase_add_test(tests, directions_are_uniform);
    tcase_add_test(tests, thin_triangles_have_no_directions);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
