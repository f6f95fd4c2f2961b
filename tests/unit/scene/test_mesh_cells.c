/* Cells of faces: halves, straight cuts, and meshes of them. */
#include "solver/base/vector3.h"
#include "solver/scene/mesh_cells.h"
#include "support/scene.h"
#include "support/solids.h"
#include "support/suite.h"

/* Halves have half of the area of a cell each, whichever side is halved, down to tiny cells. */
START_TEST(halves_of_cells_are_equal) {
    mesh m = _i == 0 ? make_cube() : make_octahedron();
    for (size_t side = 0; side < (_i == 0 ? 2u : 3u); side++) {
        mesh_cell cell = mesh_cell_of(&m, 1), halves[2];
        const double whole = m.area[1];
        ck_assert_double_eq_tol(mesh_cell_area(&cell), whole, 1e-15);
        for (size_t step = 0; mesh_cell_halve(&cell, (side + step) % (_i == 0 ? 2u : 3u), halves); step++) {
            const double area = mesh_cell_area(&cell);
            for (int k = 0; k < 2; k++)
                ck_assert_double_eq_tol(mesh_cell_area(&halves[k]), area / 2, 1e-12 * whole);
            cell = halves[step % 2];
        }
        ck_assert_double_lt(mesh_cell_area(&cell), whole * 4 * MESH_CELL_LEAST);
        ck_assert_double_ge(cell.share, MESH_CELL_LEAST);
    }
    mesh_free(&m);
}
END_TEST

/* All turns at the corners of a cell have the same sense: it is convex, and has no corner twice. */
static void check_convex(const mesh *m, const mesh_cell *c) {
    for (size_t k = 0; k < c->n; k++) {
        double a[3], b[3], turn[3], along = 0;
        subtract3(c->corner[(k + 1) % c->n], c->corner[k], a);
        subtract3(c->corner[(k + 2) % c->n], c->corner[(k + 1) % c->n], b);
        cross3(a, b, turn);
        for (int d = 0; d < 3; d++) along += turn[d] * (double)m->normal[c->face][d];
        ck_assert_double_gt(along, 0);
    }
}

/* Every cut of a quad, of a trapezoid and of a triangle leaves two convex cells of 3 or 4 corners with the
 * normal of the face, whose areas and shares add up and whose common side has the same bits; there are as
 * many cuts as counted by hand: 7 x 7 between each two sides that may be joined, 7 from a corner to each side
 * that is not its own, and two diagonals; of quarters 3 for each 7. */
START_TEST(cuts_of_cells_add_up) {
    mesh m = _i == 2 ? make_octahedron() : make_cube();
    mesh_cell cell = mesh_cell_of(&m, 1), of[2], parts[2];
    mesh_cut cuts[MESH_CUTS_MOST];
    if (_i == 1) {
        ck_assert(mesh_cell_cut(
            &cell, (mesh_cut){MESH_CELL_STEPS / 4, 2 * MESH_CELL_STEPS + MESH_CELL_STEPS / 4}, of));
        cell = of[0];
    }
    size_t n = mesh_cell_cuts(cell.n, MESH_CELL_STEPS / 4, cuts);
    ck_assert_uint_eq(n, _i == 2 ? 3 * 9 + 3 * 3 : 2 * 9 + 4 * 2 * 3 + 2);
    n = mesh_cell_cuts(cell.n, MESH_CELL_STEPS / 8, cuts);
    ck_assert_uint_eq(n, _i == 2 ? 3 * 49 + 3 * 7 : 2 * 49 + 4 * 2 * 7 + 2);
    ck_assert_uint_le(n, MESH_CUTS_MOST);
    const double area = mesh_cell_area(&cell);
    for (size_t k = 0; k < n; k++) {
        double from[3], to[3];
        ck_assert(mesh_cell_cut(&cell, cuts[k], parts));
        const double first = mesh_cell_area(&parts[0]), second = mesh_cell_area(&parts[1]);
        ck_assert_double_eq_tol(first + second, area, 1e-14 * area);
        ck_assert_double_eq_tol(parts[0].share, cell.share * first / area, 1e-14);
        ck_assert_double_eq_tol(parts[0].share + parts[1].share, cell.share, 1e-14);
        mesh_cell_place(&cell, cuts[k].from, from);
        mesh_cell_place(&cell, cuts[k].to, to);
        for (int side = 0; side < 2; side++) {
            ck_assert(parts[side].n == 3 || parts[side].n == 4);
            ck_assert_uint_eq(parts[side].face, 1);
            check_convex(&m, &parts[side]);
            ck_assert_mem_eq(parts[side].corner[0], side == 0 ? from : to, sizeof from);
            ck_assert_mem_eq(parts[side].corner[parts[side].n - 1], side == 0 ? to : from, sizeof from);
        }
    }
    mesh_free(&m);
}
END_TEST

/* Cells cover the faces in their order, keep their planes, fronts, groups and materials, and share corners.
 */
START_TEST(meshes_of_cells_cover_faces) {
    mesh m = _i == 0 ? make_cube() : make_octahedron(), fine = {0};
    mesh_cell *cells = NULL;
    size_t n;
    lam_error error = {0};
    const double area = total_area(&m), most = m.area[0] / 5;
    ck_ok(mesh_cells_even(&m, most, 1000, &cells, &n, &error));
    ck_assert_uint_eq(n, 8 * m.n);
    ck_ok(mesh_of_cells(&m, n, cells, &fine, &error));
    ck_assert_uint_eq(fine.n, n);
    ck_assert_double_eq_tol(total_area(&fine), area, 1e-12 * area);
    for (size_t i = 0; i < n; i++) {
        const size_t face = cells[i].face;
        ck_assert_uint_eq(face, i / 8);
        ck_assert_double_le(fine.area[i], most);
        ck_assert_uint_eq(fine.group[i], m.group[face]);
        ck_assert(fine.emission[i] == m.emission[face]);
        for (int d = 0; d < 3; d++) ck_assert_float_eq_tol(fine.normal[i][d], m.normal[face][d], 1e-6f);
    }
    ck_assert_uint_lt(fine.n_vertices, 2 * n); /* of 3 n or 4 n corners */
    mesh_replace(&m, &fine);
    ck_assert_uint_eq(m.n, n);
    ck_assert_str_eq(m.group_names[0], "all");
    ck_assert_ptr_null(fine.vertices);
    free(cells);
    ck_ok(mesh_cells_even(&m, 0, n + 3, &cells, &n, &error)); /* no more than may be */
    ck_assert_uint_eq(n, m.n + 3);
    free(cells);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("mesh cells");
    TCase *tests = tcase_create("mesh cells");
    tcase_set_timeout(tests, 120);
    tcase_add_loop_test(tests, halves_of_cells_are_equal, 0, 2);
    tcase_add_loop_test(tests, cuts_of_cells_add_up, 0, 3);
    tcase_add_loop_test(tests, meshes_of_cells_cover_faces, 0, 2);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
