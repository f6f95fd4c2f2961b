/* Faces that lie in a plane become one: how many are left, whose they are, and that they cover what they did.
 */
#include "solver/scene/facet/face_join.h"
#include "support/failing_memory.h"
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
    ck_ok(faces_join(&m, NULL, &error));
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
    ck_ok(faces_join(&m, NULL, &error)); /* nothing is left to join */
    ck_assert_ptr_eq(m.elements, first.elements);
    mesh_free(&m);
    folder_remove(folder);
}
END_TEST

/* Corners of an element of the plane z = 0 that is a rectangle along the axes. */
static void box_of(const mesh *m, size_t i, double low[2], double high[2]) {
    for (int d = 0; d < 2; d++) {
        low[d] = HUGE_VAL, high[d] = -HUGE_VAL;
        for (size_t c = 0; c < mesh_corners(m, i); c++) {
            low[d] = fmin(low[d], m->vertices[m->elements[i][c]][d]);
            high[d] = fmax(high[d], m->vertices[m->elements[i][c]][d]);
        }
    }
}

/* The area that an element of the floor has in common with square k of the file. */
static double common_area(const mesh *m, size_t i, uint32_t k) {
    const double from[2] = {k % SIDE, .5 * (k / SIDE)}, size[2] = {1, .5};
    double low[2], high[2], area = 1;
    box_of(m, i, low, high);
    for (int d = 0; d < 2; d++) area *= fmax(0, fmin(high[d], from[d] + size[d]) - fmax(low[d], from[d]));
    return area;
}

static double part_area(const mesh *m, size_t i, uint32_t face) {
    double sum = m->faces.of[i] == face ? m->area[i] : 0;
    for (size_t p = 0; p < m->faces.n_parts; p++)
        if (m->faces.parts[p].element == i && m->faces.parts[p].face == face) sum += m->faces.parts[p].area;
    return sum;
}

/* Elements of joined faces know what they have in common with the faces of the file: by exact rectangles on
 * the floor; all of the wall is of its two triangles. */
START_TEST(parts_of_joined_faces_know_these) {
    static const double edges[] = {0, .9, .35};
    char folder[64];
    double sums[SIDE * SIDE + 2];
    folder_make(folder);
    for (size_t e = 0; e < sizeof edges / sizeof *edges; e++) {
        mesh m = make_room(folder);
        faces_before before = {.n = 0};
        ck_ok(faces_join(&m, &before, &error));
        ck_assert_uint_eq(m.n, 4);
        if (edges[e] > 0) ck_ok(mesh_refine(&m, &(mesh_refinement){.max_edge = edges[e]}, &error));
        ck_ok(faces_part(&m, &before, &error));
        ck_ok(mesh_make_two_sided(&m, &error));
        const size_t n = m.n - m.n_backs;
        ck_assert_uint_eq(m.faces.n_faces, SIDE * SIDE + 2);
        size_t whole = 0;
        for (size_t i = 0; i < n; i++) {
            const bool of_wall = m.group[i] == group_find(&m, "wall");
            whole += m.faces.of[i] != SCENE_FACE_NONE;
            ck_assert_uint_eq(m.faces.of[i], m.faces.of[n + i]);
            double sum = 0;
            for (uint32_t k = 0; k < m.faces.n_faces; k++) {
                const double area = part_area(&m, i, k);
                sum += area;
                if (of_wall) ck_assert(k >= SIDE * SIDE || area == 0);
                if (!of_wall && k < SIDE * SIDE) ck_assert_double_eq_tol(area, common_area(&m, i, k), 1e-12);
            }
            ck_assert_double_eq_tol(sum, m.area[i], 1e-12);
        }
        ck_assert(edges[e] == 0 || whole > 0);
        scene_faces_sum(&m.faces, n, m.area, sums);
        for (size_t k = 0; k < SIDE * SIDE; k++) ck_assert_double_eq_tol(sums[k], .5, 1e-12);
        for (size_t k = SIDE * SIDE; k < SIDE * SIDE + 2; k++) ck_assert_double_eq_tol(sums[k], 9, 1e-12);
        faces_before_free(&before);
        mesh_free(&m);
    }
    folder_remove(folder);
}
END_TEST

/* Where nothing is joined faces stay what they are, and without a place for those before they are lost. */
START_TEST(faces_that_are_not_joined_stay) {
    char folder[64];
    folder_make(folder);
    mesh m = obj_good(folder, "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 1 1\nf 1 2 3\nf 1 2\nf 1 3 5\n", NULL);
    faces_before before = {.n = 0};
    ck_ok(faces_join(&m, &before, &error));
    ck_assert_uint_eq(before.n, 0);
    ck_ok(faces_part(&m, &before, &error));
    ck_assert_uint_eq(m.faces.of[0], 0);
    ck_assert_uint_eq(m.faces.of[1], 2);
    mesh_free(&m);
    m = make_room(folder);
    ck_ok(faces_join(&m, NULL, &error));
    ck_assert_ptr_null(m.faces.of);
    mesh_free(&m);
    folder_remove(folder);
}
END_TEST

/* Whichever allocation fails, nothing is lost or freed twice. */
START_TEST(memory_may_be_short) {
    char folder[64];
    long k = 0;
    lam_status status = LAM_ERR_MEMORY;
    folder_make(folder);
    for (; status == LAM_ERR_MEMORY && k < 1000; k++) {
        mesh m = make_room(folder);
        faces_before before = {.n = 0};
        allocations_left = k;
        status = faces_join(&m, &before, &error);
        if (status == LAM_OK) status = mesh_refine(&m, &(mesh_refinement){.max_edge = .9}, &error);
        if (status == LAM_OK) status = faces_part(&m, &before, &error);
        allocations_left = -1;
        faces_before_free(&before);
        mesh_free(&m);
    }
    ck_assert_int_eq(status, LAM_OK);
    ck_assert_int_gt(k, 20);
    folder_remove(folder);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("face join");
    TCase *tests = tcase_create("face join");
    tcase_add_test(tests, only_faces_of_one_material_are_joined);
    tcase_add_test(tests, parts_of_joined_faces_know_these);
    tcase_add_test(tests, faces_that_are_not_joined_stay);
    tcase_add_test(tests, memory_may_be_short);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
