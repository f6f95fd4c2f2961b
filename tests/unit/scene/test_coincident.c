/* Faces that are written twice are dropped, faces that overlap in one plane are cut by the area that they
 * have in common, and neighbours are neither. */
#include "solver/base/random.h"
#include "solver/base/vector3.h"
#include "solver/scene/coincident.h"
#include "support/scene.h"
#include "support/suite.h"

static lam_error error;

/* A square of 2 m, `floor`, whose corners are vertices 1 to 4, and the faces of a text. */
static coincident_report of_text(const char *faces, bool both_sides, mesh *out) {
    char folder[64];
    static char text[70000];
    import_report report;
    folder_make(folder);
    mtl_write(folder,
              "newmtl grey\nKd .5 .5 .5\nnewmtl dark\nKd .1 .1 .1\nnewmtl light\nKd .5 .5 .5\nKe 2 2 2\n");
    snprintf(text, sizeof text,
             "mtllib scene.mtl\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\no floor\nusemtl grey\nf 1 2 3 4\n%s",
             faces);
    char path[256];
    file_write(folder, "scene.obj", text, path);
    import_options how = import_plain();
    how.two_sided = both_sides;
    const lam_status status = scene_import(path, &how, out, &report, &error);
    ck_assert_msg(status == LAM_OK, "%s", error.message);
    folder_remove(folder);
    return report.coincident;
}

START_TEST(a_face_that_is_written_twice_is_dropped) {
    static const char *const again[] = {
        "f 1 2 3 4\n", "f 3 4 1 2\n", "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nf 6 7 8 5\n",
        /* as a writer of seven digits rounds it */
        "v 1e-7 0 0\nv 2 0 1e-7\nv 2 2 0\nv 0 2.0000001 0\nf 6 7 8 5\n", "f 1 2 3 4\nf 2 3 4 1\n"};
    mesh m;
    const coincident_report found = of_text(again[_i], false, &m);
    ck_assert_uint_eq(m.n, 1);
    ck_assert_uint_eq(found.dropped, _i == 4 ? 2 : 1);
    ck_assert_uint_eq(found.differing, 0);
    ck_assert_uint_eq(found.overlapping, 0);
    ck_assert_ptr_null(m.overlap);
    ck_assert_ptr_nonnull(strstr(found.dropped_line, "floor"));
    mesh_free(&m);
}
END_TEST

/* The first is kept, unless a later one alone emits: light would be lost without a trace. */
START_TEST(the_first_or_the_first_that_emits_is_kept) {
    mesh m;
    coincident_report found = of_text("o rug\nusemtl dark\nf 1 2 3 4\n", false, &m);
    ck_assert_uint_eq(m.n, 1);
    ck_assert_float_eq(m.reflectance[0], .5f);
    ck_assert_uint_eq(found.differing, 1);
    ck_assert_ptr_nonnull(strstr(found.dropped_line, "rug 1"));
    ck_assert_ptr_nonnull(strstr(found.dropped_line, "1 of them has another group or material"));
    ck_assert_uint_eq(group_find(&m, "rug"), m.n_groups);
    mesh_free(&m);
    found = of_text("o rug\nusemtl dark\nf 1 2 3 4\no lamp\nusemtl light\nf 2 3 4 1\n", false, &m);
    ck_assert_uint_eq(m.n, 1);
    ck_assert_float_eq(m.emission[0], 2);
    ck_assert_uint_eq(found.dropped, 2);
    ck_assert_ptr_nonnull(strstr(found.dropped_line, "of equal faces the first that emits is kept"));
    mesh_free(&m);
}
END_TEST

/* The sides of a sheet, or of a box and the floor it stands on, look at nothing in common; with both sides
 * they are four elements in place of two. */
START_TEST(opposite_faces_are_a_sheet) {
    mesh m;
    coincident_report found =
        of_text("f 4 3 2 1\nv 1 1 0\nv 1 2 0\nv 2 2 0\nv 2 1 0\nf 5 6 7 8\n", false, &m);
    ck_assert_uint_eq(found.dropped, 0);
    ck_assert_uint_eq(found.cut + found.covered, 1); /* the underside of the box with that of the floor */
    ck_assert_double_eq_tol(total_area(&m), 8, 1e-12);
    mesh_free(&m);
    found = of_text("f 4 3 2 1\n", false, &m);
    ck_assert_uint_eq(m.n, 2);
    ck_assert_uint_eq(found.dropped + found.overlapping, 0);
    mesh_free(&m);
    found = of_text("f 4 3 2 1\n", true, &m);
    ck_assert_uint_eq(m.n, 1);
    ck_assert_uint_eq(found.dropped, 1);
    mesh_free(&m);
    found = of_text("v 1 1 0\nv 1 2 0\nv 2 2 0\nv 2 1 0\nf 5 6 7 8\n", true, &m);
    ck_assert_uint_eq(found.cut, 0);
    ck_assert_uint_eq(found.covered, 1); /* of one group, the first is whole */
    mesh_free(&m);
    found = of_text("o box\nv 1 1 0\nv 1 2 0\nv 2 2 0\nv 2 1 0\nf 5 6 7 8\n", true, &m);
    ck_assert_uint_eq(found.cut, 1);
    ck_assert_double_eq_tol(group_area(&m, "floor", NULL), 3, 1e-12);
    ck_assert_double_eq_tol(group_area(&m, "box", NULL), 1, 1e-12);
    mesh_free(&m);
}
END_TEST

/* A place that two faces cover stays with the smaller surface, or with the first; 1e-5 of the scene's size
 * above the plane it is a rug. */
START_TEST(each_place_is_of_the_smaller_surface) {
    static const struct {
        const char *faces;
        double floor, other;
    } of[] = {
        {"o other\nf 1 2 3\nf 1 3 4\n", 4, 0},
        {"o other\nv 1 0 0\nv 3 0 0\nv 3 2 0\nv 1 2 0\nf 5 6 7 8\n", 4, 2},
        {"o other\nv .5 .5 0\nv 1.5 .5 0\nv 1.5 1.5 0\nv .5 1.5 0\nf 5 6 7 8\n", 3, 1},
        {"o other\nv -1 1 0\nv 1 -1 0\nv 3 1 0\nv 1 3 0\nf 5 6 7 8\n", 4, 4},
        {"o other\nv 1 0 0\nv 2 1 0\nv 1 2 0\nv 0 1 0\nf 5 6 7 8\n", 2, 2},
        {"o other\nusemtl light\nf 1 2 3\nf 1 3 4\n", 0, 4},
        {"o other\nv .5 .5 1e-5\nv 1.5 .5 1e-5\nv 1.5 1.5 1e-5\nv .5 1.5 1e-5\nf 5 6 7 8\n", 4, 1},
        {"o other\nv 2 0 0\nv 4 0 0\nv 4 2 0\nv 2 2 0\nf 5 6 7 8\n", 4, 4},
        {"o other\nv 0 0 2\nv 2 0 2\nf 2 1 5 6\n", 4, 4},
    };
    mesh m;
    const coincident_report found = of_text(of[_i].faces, false, &m);
    double area[2] = {0, 0};
    for (int k = 0; k < 2; k++)
        if (group_find(&m, k == 0 ? "floor" : "other") < m.n_groups)
            area[k] = group_area(&m, k == 0 ? "floor" : "other", NULL);
    ck_assert_double_eq_tol(area[0], of[_i].floor, 1e-9);
    ck_assert_double_eq_tol(area[1], of[_i].other, 1e-9);
    ck_assert_uint_eq(found.dropped + found.overlapping, 0);
    ck_assert_ptr_null(m.overlap);
    ck_assert((found.cut + found.covered > 0) == (_i < 6));
    if (_i < 6) ck_assert_ptr_nonnull(strstr(found.cut_line, " where others cover the same place, by "));
    for (size_t i = 0; i < m.n; i++) /* the face of the file, of which each part is one */
        ck_assert_uint_eq(m.faces.of[i] == 0, strcmp(m.group_names[m.group[i]], "floor") == 0);
    mesh_free(&m);
}
END_TEST

/* A floor of bricks, none of which shares its corners with the next row, is larger than a rug on it, however
 * small they are; and a group of many rugs in other planes is no larger surface. */
START_TEST(a_surface_is_what_hangs_together) {
    static char faces[20000];
    size_t at = 0;
    mesh m;
    int v = 5;
    at += (size_t)snprintf(faces, sizeof faces, "o bricks\n");
    for (int row = 0; row < 8; row++)
        for (int k = 0; k < 8; k++, v += 4) {
            const double x = 4 + .5 * k + (row % 2 ? .25 : 0), y = .25 * row;
            at += (size_t)snprintf(faces + at, sizeof faces - at,
                                   "v %g %g 0\nv %g %g 0\nv %g %g 0\nv %g %g 0\nf %d %d %d %d\n", x, y,
                                   x + .5, y, x + .5, y + .25, x, y + .25, v, v + 1, v + 2, v + 3);
        }
    for (int k = 0; k < 20; k++, v += 4) /* the lowest one lies on the bricks */
        at += (size_t)snprintf(faces + at, sizeof faces - at,
                               "%sv 5 .5 %d\nv 7 .5 %d\nv 7 1.5 %d\nv 5 1.5 %d\nf %d %d %d %d\n",
                               k == 0 ? "o rugs\n" : "", k, k, k, k, v, v + 1, v + 2, v + 3);
    const coincident_report found = of_text(faces, false, &m);
    ck_assert_double_eq_tol(found.cut_area, 2, 1e-9);
    ck_assert_double_eq_tol(group_area(&m, "bricks", NULL), 6, 1e-9);
    ck_assert_double_eq_tol(group_area(&m, "rugs", NULL), 40, 1e-9);
    mesh_free(&m);
}
END_TEST

/* An L of six corners that is written again from another one: both are cut into the same pieces. */
START_TEST(polygons_are_cut_alike) {
    char faces[256];
    const int k = _i;
    snprintf(faces, sizeof faces,
             "v 5 0 0\nv 9 0 0\nv 9 2 0\nv 7 2 0\nv 7 4 0\nv 5 4 0\nf 5 6 7 8 9 10\nf %d %d %d %d %d %d\n",
             5 + k % 6, 5 + (k + 1) % 6, 5 + (k + 2) % 6, 5 + (k + 3) % 6, 5 + (k + 4) % 6, 5 + (k + 5) % 6);
    mesh m;
    const coincident_report found = of_text(faces, false, &m);
    ck_assert_double_eq_tol(total_area(&m), 4 + 12, 1e-12);
    ck_assert_uint_eq(found.overlapping, 0);
    ck_assert_uint_gt(found.dropped, 0);
    mesh_free(&m);
}
END_TEST

/* Tiles and a fan that are turned at random and rounded to 4 to 9 digits: what neighbours share by that is no
 * overlap, but a large face under the tiles goes, to the area that rounding leaves. A square one step of the
 * decimals above another one stays, unless single precision would take them for one. */
enum { SIDE = 9 };
START_TEST(rounding_makes_no_overlap) {
    const int digits = 4 + _i % 6;
    uint64_t seed = (uint64_t)_i + 1;
    double axes[3][3];
    for (int d = 0; d < 3; d++) axes[0][d] = random_unit(&seed) - .5, axes[1][d] = random_unit(&seed) - .5;
    double length = sqrt(dot3(axes[0], axes[0]));
    for (int d = 0; d < 3; d++) axes[0][d] /= length;
    const double along = dot3(axes[0], axes[1]);
    for (int d = 0; d < 3; d++) axes[1][d] -= along * axes[0][d];
    length = sqrt(dot3(axes[1], axes[1]));
    for (int d = 0; d < 3; d++) axes[1][d] /= length;
    for (int under = 0; under < 3; under++) {
        static char faces[65536];
        size_t at = 0;
        for (int j = 0; j <= SIDE; j++)
            for (int i = 0; i <= SIDE; i++) {
                const double x = 4. * i / SIDE, y = 4. * j / SIDE; /* beside the square of the scene */
                at += (size_t)snprintf(faces + at, sizeof faces - at, "v %.*f %.*f %.*f\n", digits,
                                       9 + x * axes[0][0] + y * axes[1][0], digits,
                                       x * axes[0][1] + y * axes[1][1], digits,
                                       x * axes[0][2] + y * axes[1][2]);
            }
        for (int k = 0; k < SIDE * SIDE; k++) {
            const int a = k / SIDE * (SIDE + 1) + k % SIDE + 5, b = a + SIDE + 1;
            at += (size_t)snprintf(faces + at, sizeof faces - at,
                                   k % 3 == 0 ? "f %d %d %d\nf %d %d %d\n" : "f %d %d %d %d\n", a, a + 1,
                                   b + 1, k % 3 == 0 ? a : b, b + 1, b);
        }
        if (under == 1)
            at += (size_t)snprintf(faces + at, sizeof faces - at, "f 5 %d %d %d\n", 5 + SIDE,
                                   5 + SIDE * (SIDE + 1) + SIDE, 5 + SIDE * (SIDE + 1));
        const double step = pow(10, -digits); /* the square of the scene, whose decimals are all 0 */
        if (under == 2)
            at += (size_t)snprintf(faces + at, sizeof faces - at,
                                   "v 0 0 %.9f\nv 2 0 %.9f\nv 2 2 %.9f\nv 0 2 %.9f\nf -4 -3 -2 -1\n", step,
                                   step, step, step);
        ck_assert_uint_lt(at, sizeof faces - 1);
        mesh m;
        const coincident_report found = of_text(faces, false, &m);
        ck_assert_msg(found.overlapping == 0, "%s", found.overlap_line);
        /* Planes closer than a millionth of the scene's radius of 4 m and more are one in any case. */
        const bool apart = under == 2 && step >= 1e-5;
        ck_assert_msg((found.dropped + found.cut + found.covered > 0) == (under > 0 && !apart), "%s",
                      found.cut_line);
        ck_assert_double_eq_tol(total_area(&m), apart ? 24 : 20, 16 * fmax(step, 1e-6));
        mesh_free(&m);
    }
}
END_TEST

/* None of the generated scenes has a fault, and none is found in them. */
START_TEST(generated_scenes_have_none) {
    static const char *const kinds[] = {"box",      "cornell", "furnace", "city", "rooms",
                                        "anechoic", "patio",   "atrium",  "maze", "canopy"};
    generate_options how = {
        .kind = kinds[_i], .size = {3, 2, 1}, .elements = 400, .variant = 1, .terrain = "hill", .seed = 1};
    mesh m = generate_good(&how);
    coincident_report found;
    const size_t before = m.n;
    ck_ok(mesh_settle_coincident(&m, false, &found, &error));
    ck_assert_uint_eq(m.n, before);
    ck_assert_uint_eq(found.dropped + found.cut + found.covered + found.overlapping, 0);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("coincident");
    TCase *tests = tcase_create("coincident");
    tcase_add_loop_test(tests, a_face_that_is_written_twice_is_dropped, 0, 5);
    tcase_add_test(tests, the_first_or_the_first_that_emits_is_kept);
    tcase_add_test(tests, opposite_faces_are_a_sheet);
    tcase_add_loop_test(tests, each_place_is_of_the_smaller_surface, 0, 9);
    tcase_add_test(tests, a_surface_is_what_hangs_together);
    tcase_add_loop_test(tests, polygons_are_cut_alike, 0, 6);
    tcase_add_loop_test(tests, rounding_makes_no_overlap, 0, 18);
    tcase_add_loop_test(tests, generated_scenes_have_none, 0, 10);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
