/* Cameras and smoothing on meshes made by hand. */
#include "solver/render/camera.h"
#include "solver/render/shade.h"
#include "solver/render/smooth.h"
#include "support/box.h"
#include "support/suite.h"

static const double unit_cube[3] = {1, 1, 1};

/* A flat rectangle at z = 0 that looks up. */
static void add_tile(mesh *m, double x, double y, double width, double height) {
    const double corners[4][3] = {
        {x, y, 0}, {x + width, y, 0}, {x + width, y + height, 0}, {x, y + height, 0}};
    mesh_add_quad(m, corners);
}

START_TEST(test_weights) {
    /* The weights in a convex quad sum to 1 and reproduce the point itself; they are linear on an edge and at
     * a corner. Rounding of a few operations on numbers of size 3: 1e-12. */
    const double quad[4][3] = {{0, 0, 1}, {3, 0, 1}, {2, 2, 1}, {0, 1, 1}}, up[3] = {0, 0, 1};
    const double points[][3] = {{.5, .5, 1},   {1, .9, 1},    {0, 0, 1},    {3, 0, 1},
                                {1.5, 0, 1},   {0, .3, 1},    {2.5, 1, 1},  {1, 1.5, 1},
                                {1e-9, .5, 1}, {1, 1e-14, 1}, {2.7, .1, 1}, {1.99, 1.98, 1}};
    for (size_t i = 0; i < sizeof points / sizeof points[0]; i++) {
        double weights[4], sum = 0, at[2] = {0, 0};
        smooth_weights(quad, 4, up, points[i], weights);
        for (int k = 0; k < 4; k++) {
            sum += weights[k];
            for (int d = 0; d < 2; d++) at[d] += weights[k] * quad[k][d];
            ck_assert_double_ge(weights[k], -1e-9);
        }
        ck_assert_double_eq_tol(sum, 1, 1e-12);
        for (int d = 0; d < 2; d++) ck_assert_double_eq_tol(at[d], points[i][d], 1e-9);
    }
}
END_TEST

static float shown_at(const shade *s, uint32_t element, double x, double y) {
    const double point[3] = {x, y, 0};
    float value;
    shade_at(s, element, point, &value);
    return value;
}

START_TEST(test_smooth_joins_and_separates) {
    /* Two tiles of a floor and one of a wall at right angles to them, all of one group. */
    mesh m = {0};
    lam_error error = {0};
    shade *s = NULL;
    smooth_nodes nodes = {0};
    add_tile(&m, 0, 0, 1, 1);
    add_tile(&m, 1, 0, 1, 1);
    const double wall[4][3] = {{2, 0, 0}, {2, 0, 1}, {2, 1, 1}, {2, 1, 0}};
    mesh_add_quad(&m, wall);
    mesh_finish(&m, .5f);
    const float values[3] = {1, 3, 100};
    ck_assert_int_eq(smooth_nodes_create(&m, &nodes, NULL), LAM_OK);
    ck_assert_msg(shade_create(&m, 1, values, NULL, &nodes, &s, &error) == LAM_OK, "%s", error.message);
    /* The common edge has the mean; light goes on along the line through both, whatever the wall has. */
    ck_assert_float_eq_tol(shown_at(s, 0, 1, .5), 2, 1e-6f);
    ck_assert_float_eq_tol(shown_at(s, 1, 1, .5), 2, 1e-6f);
    ck_assert_float_eq_tol(shown_at(s, 0, 0, .5), 0, 1e-6f);
    ck_assert_float_eq_tol(shown_at(s, 1, 2, .5), 4, 1e-6f);
    ck_assert_float_eq_tol(shown_at(s, 1, 1.5, .25), 3, .05f);
    shade_destroy(s);
    /* Another group: no mixing. */
    m.group[1] = 1;
    smooth_nodes_free(&nodes);
    ck_assert_int_eq(smooth_nodes_create(&m, &nodes, NULL), LAM_OK);
    ck_assert_msg(shade_create(&m, 1, values, NULL, &nodes, &s, &error) == LAM_OK, "%s", error.message);
    ck_assert_float_eq_tol(shown_at(s, 0, 1, .5), 1, 1e-6f);
    shade_destroy(s);
    m.group[1] = 0;
    smooth_nodes_free(&nodes);
    ck_assert_int_eq(smooth_nodes_create(&m, &nodes, NULL), LAM_OK);
    /* Emission stays in its element; what else there is, 1 and 1, does not vary. */
    const float E[3] = {0, 2, 0};
    ck_assert_msg(shade_create(&m, 1, values, E, &nodes, &s, &error) == LAM_OK, "%s", error.message);
    ck_assert_float_eq_tol(shown_at(s, 0, 1, .5), 1, 1e-6f);
    ck_assert_float_eq_tol(shown_at(s, 1, 1, .5), 3, 1e-6f);
    shade_destroy(s);
    /* Light is never negative: 0 at x = 0, where the line through both has -1. */
    const float steep[3] = {1, 5, 0};
    ck_assert_msg(shade_create(&m, 1, steep, NULL, &nodes, &s, &error) == LAM_OK, "%s", error.message);
    ck_assert_float_eq_tol(shown_at(s, 0, 0, .5), 0, 1e-6f);
    ck_assert_float_eq_tol(shown_at(s, 1, 2, .5), 7, 1e-6f);
    shade_destroy(s);
    /* Not smooth: every element its own value everywhere. */
    ck_assert_msg(shade_create(&m, 1, values, NULL, NULL, &s, &error) == LAM_OK, "%s", error.message);
    ck_assert_float_eq(shown_at(s, 0, 1, .5), 1);
    shade_destroy(s);
    smooth_nodes_free(&nodes);
    mesh_free(&m);
}
END_TEST

START_TEST(test_smooth_has_no_cracks) {
    /* A large tile beside a column of three, the middle one cut again: nodes that hang on one edge, and one
     * that hangs on an edge whose end hangs itself. */
    mesh m = {0};
    lam_error error = {0};
    shade *s = NULL;
    smooth_nodes nodes = {0};
    add_tile(&m, 0, 0, 3, 3);
    add_tile(&m, 3, 0, 1, 1);
    add_tile(&m, 3, 1, .5, .4);
    add_tile(&m, 3.5, 1, .5, .4);
    add_tile(&m, 3, 1.4, 1, .6);
    add_tile(&m, 3, 2, 1, 1);
    mesh_finish(&m, .5f);
    const float values[6] = {1, 7, 2, 9, 4, 6};
    ck_assert_int_eq(smooth_nodes_create(&m, &nodes, NULL), LAM_OK);
    ck_assert_msg(shade_create(&m, 1, values, NULL, &nodes, &s, &error) == LAM_OK, "%s", error.message);
    for (int i = 1; i < 300; i++) {
        const double y = i / 100.0;
        const uint32_t beside = y <= 1 ? 1 : y <= 1.4 ? 2 : y <= 2 ? 4 : 5;
        ck_assert_float_eq_tol(shown_at(s, 0, 3, y), shown_at(s, beside, 3, y), 1e-5f);
    }
    for (int i = 1; i < 100; i++) {
        const double x = 3 + i / 100.0;
        ck_assert_float_eq_tol(shown_at(s, x <= 3.5 ? 2 : 3, x, 1), shown_at(s, 1, x, 1), 1e-5f);
        ck_assert_float_eq_tol(shown_at(s, x <= 3.5 ? 2 : 3, x, 1.4), shown_at(s, 4, x, 1.4), 1e-5f);
    }
    shade_destroy(s);
    smooth_nodes_free(&nodes);
    mesh_free(&m);
}
END_TEST

START_TEST(test_camera_axes) {
    const double eye[3] = {0, -5, 1}, target[3] = {0, 0, 1};
    camera c;
    double direction[3];
    ck_assert_int_eq(camera_look(eye, target, 90, 2, 'z', &c, NULL), LAM_OK);
    /* Looking north with up z: the right edge is east, the top edge up; tan 45 = 1, twice as wide. */
    camera_direction(&c, 1, 0, direction);
    const double expected[3] = {2, 1, 1};
    for (int d = 0; d < 3; d++) ck_assert_double_eq_tol(direction[d], expected[d], 1e-12);
    ck_assert_int_eq(camera_look(eye, eye, 40, 1, 'z', &c, NULL), LAM_ERR_ARGUMENT);
    ck_assert_int_eq(camera_look(eye, target, 0, 1, 'z', &c, NULL), LAM_ERR_ARGUMENT);
    ck_assert_int_eq(camera_look(eye, target, 180, 1, 'z', &c, NULL), LAM_ERR_ARGUMENT);
    /* Straight down is a view like others. */
    const double above[3] = {0, 0, 9};
    ck_assert_int_eq(camera_look(above, (const double[3]){0, 0, 0}, 40, 1, 'z', &c, NULL), LAM_OK);
    ck_assert_double_eq_tol(c.up[1], 1, 1e-12);
}
END_TEST

START_TEST(test_camera_finds_the_open_side) {
    /* A box without one of its walls (x0 x1 y0 y1, as support/box.h counts) is looked into through the gap.
     */
    static const double into[4][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}};
    lam_error error = {0};
    mesh m = {0};
    visibility *v = NULL;
    camera c;
    for (size_t i = 0; i < 6; i++) {
        const box_cell cell = box_cell_of(unit_cube, 1, i);
        if ((int)i != _i) mesh_add_cell(&m, &cell, cell.level == 0);
    }
    mesh_finish(&m, .5f);
    const bool lit[5] = {true, true, true, true, true};
    ck_assert_msg(visibility_create(&m, &v, &error) == LAM_OK, "%s", error.message);
    ck_assert_msg(camera_choose(&m, v, lit, 1, &c, &error) == LAM_OK, "%s", error.message);
    for (int d = 0; d < 3; d++) ck_assert_double_eq_tol(c.forward[d], into[_i][d], 1e-9);
    /* Everything is inside the picture and something is near its edge. */
    double widest = 0;
    for (size_t i = 0; i < m.n_vertices; i++) {
        double along = 0, side = 0, height = 0;
        for (int d = 0; d < 3; d++) {
            along += (m.vertices[i][d] - c.eye[d]) * c.forward[d];
            side += (m.vertices[i][d] - c.eye[d]) * c.right[d];
            height += (m.vertices[i][d] - c.eye[d]) * c.up[d];
        }
        ck_assert_double_gt(along, 0);
        widest = fmax(widest, fmax(fabs(side) / (along * c.tan_x), fabs(height) / (along * c.tan_y)));
    }
    ck_assert_double_lt(widest, 1);
    ck_assert_double_gt(widest, .9);
    visibility_destroy(v);
    mesh_free(&m);
}
END_TEST

START_TEST(test_camera_enters_what_is_shut) {
    /* A lit box inside the dark outside of a larger one: the light is seen from within only. */
    const double outer[3] = {1.2, 1.2, 1.2};
    lam_error error = {0};
    mesh m = box_mesh(unit_cube, 1, .5f);
    visibility *v = NULL;
    camera c;
    mesh_free(&m);
    for (size_t i = 0; i < 12; i++) {
        box_cell cell = box_cell_of(i < 6 ? unit_cube : outer, 1, i % 6);
        const bool low = cell.level == 0;
        if (i >= 6) {
            cell.level -= .1;
            for (int d = 0; d < 3; d++) {
                cell.from[d] -= .1;
                cell.to[d] -= .1;
            }
        }
        mesh_add_cell(&m, &cell, i < 6 ? low : !low);
    }
    mesh_finish(&m, .5f);
    const bool lit[12] = {true, true, true, true, true, true};
    ck_assert_msg(visibility_create(&m, &v, &error) == LAM_OK, "%s", error.message);
    ck_assert_msg(camera_choose(&m, v, lit, 1, &c, &error) == LAM_OK, "%s", error.message);
    for (int d = 0; d < 3; d++) {
        ck_assert_double_gt(c.eye[d], 0);
        ck_assert_double_lt(c.eye[d], 1);
    }
    visibility_destroy(v);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("picture");
    TCase *tests = tcase_create("picture");
    tcase_set_timeout(tests, 60);
    tcase_add_test(tests, test_weights);
    tcase_add_test(tests, test_smooth_joins_and_separates);
    tcase_add_test(tests, test_smooth_has_no_cracks);
    tcase_add_test(tests, test_camera_axes);
    tcase_add_loop_test(tests, test_camera_finds_the_open_side, 0, 4);
    tcase_add_test(tests, test_camera_enters_what_is_shut);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
