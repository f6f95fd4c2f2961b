/* Parts of scenes that exchange no light. */
#include "solver/base/union_find.h"
#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/pairs/ray_rows.h"
#include "solver/formfactor/source.h"
#include "solver/formfactor/visibility/parts.h"
#include "support/box.h"
#include "support/dense.h"
#include "support/suite.h"

#include <omp.h>

static lam_error error;
static const double unit_cube[3] = {1, 1, 1};

enum { SIDE = 5, FACE = SIDE * SIDE, CUBE = 6 * FACE, WINDOW = (SIDE - 2) * (SIDE - 2) };

/* Unit cubes seen from within, one metre apart along x, their floors in one plane. The first one has no
 * window, or one into the second: all but the margins of the walls between them is left out of both, and the
 * way there has no walls. */
static mesh cubes(size_t count, bool window) {
    mesh m = {.n = 0};
    for (size_t k = 0; k < count; k++)
        for (size_t i = 0; i < CUBE; i++) {
            box_cell cell = box_cell_of(unit_cube, SIDE, i);
            if (window && i / FACE == 1 - k && cell.from[1] > .1 && cell.to[1] < .9 && cell.from[2] > .1 &&
                cell.to[2] < .9)
                continue;
            cell.from[0] += 2 * (double)k;
            cell.to[0] += 2 * (double)k;
            if (cell.axis == 0) cell.level += 2 * (double)k;
            mesh_add_cell(&m, &cell, i / FACE % 2 == 0);
        }
    return m;
}

static uint32_t *parts_of(const mesh *m, size_t *count) {
    visibility *v;
    uint32_t *part = test_allocate(m->n, sizeof *part);
    ck_ok(visibility_create(m, &v, &error));
    ck_ok(visibility_parts(m, v, part, count, &error));
    visibility_destroy(v);
    return part;
}

START_TEST(closed_boxes_are_parts) {
    for (size_t boxes = 1; boxes <= 3; boxes++) {
        mesh m = cubes(boxes, false);
        size_t count;
        mesh_finish(&m, .5f);
        uint32_t *part = parts_of(&m, &count);
        ck_assert_uint_eq(count, boxes);
        for (size_t i = 0; i < m.n; i++) ck_assert_uint_eq(part[i], i / CUBE);
        free(part);
        mesh_free(&m);
    }
}
END_TEST

/* A window joins two boxes, and a third is alone. */
START_TEST(a_window_joins_parts) {
    mesh m = cubes(3, true);
    size_t count;
    mesh_finish(&m, .5f);
    uint32_t *part = parts_of(&m, &count);
    ck_assert_uint_eq(count, 2);
    for (size_t i = 0; i < m.n; i++) ck_assert_uint_eq(part[i], i >= 2 * (CUBE - WINDOW));
    free(part);
    mesh_free(&m);
}
END_TEST

/* An element that sees nothing is alone, and one that sees the backs of others. */
START_TEST(what_sees_nothing_is_alone) {
    mesh m = {.n = 0};
    const box_cell up = {2, 5, {0, 0, 5}, {1, 1, 5}}, below = {2, -.25, {0, 0, -.25}, {1, 1, -.25}};
    mesh_add_cell(&m, &up, true);
    for (size_t i = 0; i < CUBE; i++) {
        const box_cell cell = box_cell_of(unit_cube, SIDE, i);
        mesh_add_cell(&m, &cell, i / FACE % 2 == 0);
    }
    mesh_add_cell(&m, &below, true);
    size_t count;
    mesh_finish(&m, .5f);
    uint32_t *part = parts_of(&m, &count);
    ck_assert_uint_eq(count, 3);
    for (size_t i = 0; i < m.n; i++)
        ck_assert_uint_eq(part[i], i == 0 || i == m.n - 1 ? UNION_FIND_ALONE : 1);
    plane_tree tree;
    ck_ok(form_factors_tree(&m, &tree, &error));
    ck_assert_uint_eq(tree.n_alone, 2);
    ck_assert_uint_eq(tree.order[m.n - 2] + tree.order[m.n - 1], m.n - 1);
    plane_tree_free(&tree);
    free(part);
    mesh_free(&m);
}
END_TEST

START_TEST(parts_do_not_depend_on_threads) {
    mesh m = cubes(3, true);
    size_t count[2];
    mesh_finish(&m, .5f);
    omp_set_num_threads(1);
    uint32_t *one = parts_of(&m, &count[0]);
    omp_set_num_threads(4);
    uint32_t *four = parts_of(&m, &count[1]);
    ck_assert_uint_eq(count[0], count[1]);
    ck_assert(memcmp(one, four, m.n * sizeof *one) == 0);
    free(one);
    free(four);
    mesh_free(&m);
}
END_TEST

/* The tree of blocks, and streams of rows, know them; of one part neither says anything. */
START_TEST(trees_and_streams_know_parts) {
    for (size_t boxes = 1; boxes <= 2; boxes++) {
        mesh m = cubes(boxes, false);
        plane_tree tree;
        ray_rows *rows;
        row_stream stream;
        const form_factor_options how = {.recipe = {.source = &source_rays, .rays = 64, .seed = 1}};
        mesh_finish(&m, .5f);
        ck_ok(form_factors_tree(&m, &tree, &error));
        ck_assert_uint_eq(tree.n_alone, 0);
        for (size_t t = 0; t < tree.n_clusters; t++)
            ck_assert(tree.clusters[t].apart == (boxes == 2 && t == tree.n_clusters - 1));
        ck_ok(ray_rows_create(&m, &how, &rows, &error));
        ray_rows_stream(rows, 2, &stream);
        ck_assert((stream.part != NULL) == (boxes == 2));
        for (size_t i = 0; boxes == 2 && i < m.n; i++) ck_assert_uint_eq(stream.part[i], i / CUBE);
        ray_rows_destroy(rows);
        plane_tree_free(&tree);
        mesh_free(&m);
    }
}
END_TEST

int main(void) {
    Suite *suite = suite_create("parts");
    TCase *tests = tcase_create("parts");
    tcase_set_timeout(tests, 120);
    tcase_add_test(tests, closed_boxes_are_parts);
    tcase_add_test(tests, a_window_joins_parts);
    tcase_add_test(tests, what_sees_nothing_is_alone);
    tcase_add_test(tests, parts_do_not_depend_on_threads);
    tcase_add_test(tests, trees_and_streams_know_parts);
    suite_add_tcase(suite, tests);
    return suite_run_together(suite);
}
