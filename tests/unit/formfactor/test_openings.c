/* Cracks and openings: which gaps let light out of a scene, whatever share of its area they have. */
#include "solver/formfactor/leaving.h"
#include "solver/formfactor/source.h"
#include "solver/formfactor/visibility/openings.h"
#include "support/box.h"
#include "support/suite.h"

#include <omp.h>

static form_factors make(const mesh *m, recipe how) {
    uint32_t *order = malloc(m->n * sizeof *order);
    lam_error error = {0};
    form_factors f = {0};
    const form_factor_options options = {.recipe = how};
    ck_ok(mesh_z_order(m, order, &error));
    ck_ok(form_factors_make(m, order, &options, &f, &error));
    free(order);
    return f;
}

static const recipe by_rays = {.rays = 1024, .seed = 1};
static const recipe by_pairs = {.source = &source_pairs, .rays = 1024, .accuracy = 7e-5, .seed = 1};

static void add(mesh *m, int axis, double level, const double from[3], const double to[3], bool positive) {
    box_cell cell = {
        .axis = axis, .level = level, .from = {from[0], from[1], from[2]}, .to = {to[0], to[1], to[2]}};
    cell.from[axis] = cell.to[axis] = level;
    mesh_add_cell(m, &cell, positive);
}

/* A face of a box, in divisions x divisions cells. */
static void add_face(mesh *m, int axis, double level, const double size[3], int divisions, bool positive) {
    const int u = (axis + 1) % 3, w = (axis + 2) % 3;
    for (int i = 0; i < divisions; i++)
        for (int j = 0; j < divisions; j++) {
            double from[3] = {0}, to[3] = {0};
            from[u] = size[u] * i / divisions;
            to[u] = size[u] * (i + 1) / divisions;
            from[w] = size[w] * j / divisions;
            to[w] = size[w] * (j + 1) / divisions;
            add(m, axis, level, from, to, positive);
        }
}

/* A unit cube from inside whose faces stand gap too far outside, with seams open all along. */
static void add_cube(mesh *m, double gap) {
    const double size[3] = {1, 1, 1};
    for (int axis = 0; axis < 3; axis++) {
        add_face(m, axis, -gap, size, 4, true);
        add_face(m, axis, 1 + gap, size, 4, false);
    }
}

static mesh cube_with_gaps(double gap) {
    mesh m = {0};
    add_cube(&m, gap);
    mesh_finish(&m, .5f);
    return m;
}

/* A hall of 100 x 100 x 8 m with a square skylight in the middle, in pieces that share no corners with it. */
static mesh hall(double skylight) {
    const double size[3] = {100, 100, 8}, low = 50 - sqrt(skylight) / 2, high = 100 - low;
    mesh m = {0};
    add_face(&m, 2, 0, size, 10, true);
    for (int axis = 0; axis < 2; axis++) {
        add_face(&m, axis, 0, size, 3, true);
        add_face(&m, axis, size[axis], size, 3, false);
    }
    add(&m, 2, 8, (double[]){0, 0, 8}, (double[]){100, low, 8}, false);
    add(&m, 2, 8, (double[]){0, high, 8}, (double[]){100, 100, 8}, false);
    add(&m, 2, 8, (double[]){0, low, 8}, (double[]){low, high, 8}, false);
    add(&m, 2, 8, (double[]){high, low, 8}, (double[]){100, high, 8}, false);
    mesh_finish(&m, .5f);
    return m;
}

/* The diagonal is 1.73, so that gaps up to .0022 are cracks. Seams .001 wide lose .2 % of all light, twenty
 * times as much as the largest skylight of the hall; seams .01 wide are openings. */
START_TEST(seams_are_cracks) {
    static const double gaps[] = {0, 1e-6, 1e-4, 1e-3, 1e-2};
    for (int k = 0; k < 5; k++)
        for (int way = 0; way < 2; way++) {
            mesh m = cube_with_gaps(gaps[k]);
            form_factors f = make(&m, way == 0 ? by_rays : by_pairs);
            ck_assert_msg(f.closed == (gaps[k] < 5e-3), "gap %g: closed %d, openings %g", gaps[k], f.closed,
                          f.outlet.openings);
            ck_assert(f.outlet.fronts_only);
            if (gaps[k] >= 1e-4) ck_assert_double_gt(f.leaving_share, 1e-4);
            for (size_t i = 0; i < m.n && f.closed; i++) ck_assert_double_eq_tol(f.row_sums[i], 1, 1e-6);
            form_factors_free(&f);
            mesh_free(&m);
        }
}
END_TEST

/* Walls that stand on a floor a little larger than the room: light of the floor beyond them leaves freely. */
START_TEST(rims_are_cracks) {
    const double size[3] = {1, 1, 1}, beyond = 5e-5;
    mesh m = {0};
    for (int axis = 0; axis < 3; axis++) {
        if (axis < 2) add_face(&m, axis, 0, size, 4, true);
        add_face(&m, axis, 1, size, 4, false);
    }
    add(&m, 2, 0, (double[]){-beyond, -beyond, 0}, (double[]){1 + beyond, 1 + beyond, 0}, true);
    mesh_finish(&m, .5f);
    recipe how = by_rays;
    how.rays = 1 << 17;
    form_factors f = make(&m, how);
    ck_assert_double_gt(f.leaving_share, 0);
    ck_assert(f.closed);
    form_factors_free(&f);
    mesh_free(&m);
}
END_TEST

/* Skylights of 1e-5 to 1.7e-4 of all area. The light that leaves is that which the hole lets through: of that
 * of the room's walls, A_hole / A_room when they are lit alike, since the hole receives A_hole of it. */
START_TEST(skylights_are_open) {
    static const double areas[] = {.25, 1, 2, 2.7, 4};
    for (int k = 0; k < 5; k++) {
        mesh m = hall(areas[k]);
        recipe how = by_pairs;
        how.rays = 1 << 14;
        form_factors f = make(&m, how);
        double out = 0;
        for (size_t i = 0; i < m.n; i++) out += m.area[i] * (1 - f.row_sums[i]);
        ck_assert(!f.closed);
        /* Near the corners of the smallest, .5 m wide, chords are shorter than the .18 m of a crack. */
        ck_assert_double_gt(f.outlet.openings, areas[k] < 1 ? .3 : .6);
        /* Nothing is hidden: only quadrature and its tolerance of 1e-5 of each factor stand between, over
         * 23,200 m^2 in all, a hundredth of which does not cancel. */
        ck_assert_double_eq_tol(out, areas[k], 23200 * 1e-5 * .01 + .02 * areas[k]);
        form_factors_free(&f);
        mesh_free(&m);
    }
}
END_TEST

START_TEST(user_overrules) {
    mesh open = hall(4), cracked = cube_with_gaps(1e-3);
    recipe how = by_rays;
    how.closure = CLOSURE_CLOSED;
    form_factors f = make(&open, how);
    ck_assert(f.closed);
    for (size_t i = 0; i < open.n; i++) ck_assert_double_eq_tol(f.row_sums[i], 1, 1e-6);
    form_factors_free(&f);
    how.closure = CLOSURE_OPEN;
    f = make(&cracked, how);
    double out = 0;
    for (size_t i = 0; i < cracked.n; i++) out += cracked.area[i] * (1 - f.row_sums[i]) / 6;
    ck_assert(!f.closed);
    /* Of the light that leaves, the repair scales a part as it scales rows, within the noise of 96 x 1,024
     * rays, sqrt(.003 / 98304). */
    ck_assert_double_eq_tol(out, f.leaving_share, 5 * sqrt(.003 / 98304) + .1 * f.leaving_share);
    form_factors_free(&f);
    mesh_free(&open);
    mesh_free(&cracked);
}
END_TEST

/* A small face that looks outward absorbs what it meets, however little that is. */
START_TEST(small_back_absorbs) {
    const double side = 1e-2; /* 1.7e-5 of the walls, its back meets twice that share of the light */
    mesh m = {0};
    add_cube(&m, 0);
    add(&m, 2, .5, (double[]){.5, .5, .5}, (double[]){.5 + side, .5 + side, .5}, true);
    mesh_finish(&m, .5f);
    recipe how = by_rays;
    how.rays = 1 << 16;
    form_factors f = make(&m, how);
    ck_assert_double_lt(f.absorbed_share, 1e-4);
    ck_assert_double_gt(f.absorbed_share, 0);
    ck_assert(f.closed);
    ck_assert(!f.outlet.fronts_only);
    ck_assert(!leaving_nothing(&f));
    form_factors_free(&f);
    mesh_free(&m);
}
END_TEST

/* A slit between two halves of a plate, seen from a plate below: the width of the slit decides, from any
 * distance. */
START_TEST(width_of_a_slit) {
    for (int far = 0; far < 2; far++)
        for (int wide = 0; wide < 2; wide++) {
            const double width = .01, slit = wide ? 1.1 * width : .7 * width, height = far ? 4 : .25;
            mesh m = {0};
            add(&m, 2, 0, (double[]){-1, -1, 0}, (double[]){1, 1, 0}, true);
            add(&m, 2, height, (double[]){-1, -2, height}, (double[]){-slit / 2, 2, height}, false);
            add(&m, 2, height, (double[]){slit / 2, -2, height}, (double[]){1, 2, height}, false);
            mesh_finish(&m, .5f);
            visibility *v = NULL;
            lam_error error = {0};
            ck_ok(visibility_create(&m, &v, &error));
            const double at[3] = {.3, .2, 0}, to[3] = {.1 * slit, .5, height};
            float origin[3], direction[3];
            visibility_recentre(v, at, origin);
            for (int d = 0; d < 3; d++) direction[d] = (float)(to[d] - at[d]);
            ck_assert_int_eq(openings_is_crack(v, &m, width, origin, direction, 0), !wide);
            visibility_destroy(v);
            mesh_free(&m);
        }
}
END_TEST

START_TEST(same_for_any_threads) {
    mesh m = hall(.25);
    double openings[2];
    for (int k = 0; k < 2; k++) {
        omp_set_num_threads(k == 0 ? 1 : 4);
        form_factors f = make(&m, by_rays);
        openings[k] = f.outlet.openings;
        form_factors_free(&f);
    }
    ck_assert(openings[0] == openings[1]);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("openings");
    TCase *tc = tcase_create("openings");
    tcase_set_timeout(tc, 120);
    tcase_add_test(tc, seams_are_cracks);
    tcase_add_test(tc, rims_are_cracks);
    tcase_add_test(tc, skylights_are_open);
    tcase_add_test(tc, user_overrules);
    tcase_add_test(tc, small_back_absorbs);
    tcase_add_test(tc, width_of_a_slit);
    tcase_add_test(tc, same_for_any_threads);
    suite_add_tcase(suite, tc);
    return suite_run(suite);
}
