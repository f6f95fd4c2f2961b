/* Faces that lie in a plane become one: how many are left, whose they are, and that they cover what they did.
 */
#include "solver/scene/facet/face_join.h"
#include "support/scene.h"
#include "support/suite.h"

static lam_error error;

/* A floor of SIDE x SIDE squares in the plane z = 0, its first row of the group `lamp`, which shines, its
 * second one of `rug`, and above it a wall of two triangles. */
enum { SIDE = 6 };
static mesh make_room(const char *folder) {
    char text[8192];
    size_t at = (size_t)snprintf(text, sizeof text, "mtllib scene.mtl\n");
    for (int j = 0; j <= SIDE; j++)
        for (int i = 0; i <= SIDE; i++)
            at += (size_t)snprintf(text + at, sizeof text - at, "v %d %g 0\n", i, .5 * j);
    at += (size_t)snprintf(text + at, sizeof text - at, "v 0 0 3\nv 6 0 3\n");
    for (int k = 0; k < SIDE * SIDE; k++) {
        const int a = k / SIDE * (SIDE + 1) + k % SIDE + 1;
        const char *group = k < SIDE ? "lamp" : k < 2 * SIDE ? "rug" : "floor";
        const char *material = k < SIDE ? "light" : "grey";
        at += (size_t)snprintf(text + at, sizeof text - at, "g %s\nusemtl %s\nf %d %d %d %d\n", group,
                               material, a, a + 1, a + SIDE + 2, a + SIDE + 1);
    }
    at += (size_t)snprintf(text + at, sizeof text - at, "g wall\nusemtl grey\nf 1 7 51\nf 1 51 50\n");
    ck_assert_uint_lt(at, sizeof text);
    mtl_write(folder, "newmtl light\nKd .5 .5 .5\nKe 2 2 2\nnewmtl grey\nKd .5 .5 .5\n");
    return obj_good(folder, text, NULL);
}

/* The power that is emitted. */
static double light_of(const mesh *m) {
    double sum = 0;
    for (size_t i = 0; i < m->n; i++) sum += (double)m->emission[i] * m->area[i];
    return sum;
}

/* A lamp, a rug, the floor without a square of another reflectance, in four rectangles about it, and the
 * wall. */
START_TEST(only_faces_of_one_material_are_joined) {
    char folder[64];
    folder_make(folder);
    mesh m = make_room(folder);
    ck_assert_uint_eq(m.n_channels, 1);
    const double area = total_area(&m), light = light_of(&m), floor = group_area(&m, "floor", NULL);
    ck_assert_uint_eq(m.n, SIDE * SIDE + 2);
    m.reflectance[20] = .3f;
    ck_ok(faces_join(&m, &error));
    ck_assert_uint_eq(m.n, 1 + 1 + 4 + 1 + 1);
    ck_assert_double_eq_tol(total_area(&m), area, 1e-12 * area);
    ck_assert_double_eq_tol(light_of(&m), light, 1e-12 * light);
    ck_assert_double_eq_tol(group_area(&m, "floor", NULL), floor, 1e-12 * floor);
    size_t n_dark = 0;
    for (size_t i = 0; i < m.n; i++) {
        const bool is_dark = m.reflectance[i] < .45f;
        n_dark += is_dark;
        ck_assert_double_le(is_dark ? m.area[i] : 0, .5 + 1e-12);
        ck_assert_uint_eq(mesh_corners(&m, i), 4);
        ck_assert_float_eq_tol(m.normal[i][m.group[i] == group_find(&m, "wall") ? 1 : 2],
                               m.group[i] == group_find(&m, "wall") ? -1 : 1, 1e-6f);
    }
    ck_assert_uint_eq(n_dark, 1);
    const mesh first = m;
    ck_ok(faces_join(&m, &error)); /* nothing is left to join */
    ck_assert_ptr_eq(m.elements, first.elements);
    mesh_free(&m);
    folder_remove(folder);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("face join");
    TCase *tests = tcase_create("face join");
    tcase_add_test(tests, only_faces_of_one_material_are_joined);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
