/* Surfaces: elements that touch and face about the same way. */
#include "solver/scene/surfaces.h"
#include "support/box.h"
#include "support/suite.h"

static lam_error error;

static size_t surfaces_of(const mesh *m, uint32_t *surface) {
    size_t count = 0;
    ck_assert_msg(mesh_surfaces(m, surface, &count, &error) == LAM_OK, "%s", error.message);
    for (size_t i = 0; i < m->n; i++) ck_assert_uint_lt(surface[i], count);
    return count;
}

/* Every cell of box_mesh has four vertices of its own: equal places are recognized. */
START_TEST(a_box_has_six) {
    const double size[3] = {10, 6, 3};
    mesh m = box_mesh(size, 5, .5f);
    uint32_t surface[150];
    ck_assert_uint_eq(surfaces_of(&m, surface), 6);
    for (size_t i = 0; i < m.n; i++) ck_assert_uint_eq(surface[i], i / 25);
    mesh_free(&m);
}
END_TEST

/* Quads of width 1 side by side, the second folded up by an angle. */
static size_t folded(double degrees, double gap) {
    const double c = cos(degrees * M_PI / 180), s = sin(degrees * M_PI / 180);
    const double flat[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    const double turned[4][3] = {{1 + gap, 0, 0}, {1 + gap + c, 0, s}, {1 + gap + c, 1, s}, {1 + gap, 1, 0}};
    mesh m = {0};
    uint32_t surface[2];
    mesh_add_quad(&m, flat);
    mesh_add_quad(&m, turned);
    mesh_finish(&m, .5f);
    const size_t count = surfaces_of(&m, surface);
    ck_assert(surface[0] == 0 && surface[1] == count - 1);
    mesh_free(&m);
    return count;
}

START_TEST(a_fold_parts_from_30_degrees_on) {
    ck_assert_uint_eq(folded(0, 0), 1);
    ck_assert_uint_eq(folded(29, 0), 1);
    ck_assert_uint_eq(folded(-29, 0), 1);
    ck_assert_uint_eq(folded(31, 0), 2);
    ck_assert_uint_eq(folded(180, 0), 2);
    ck_assert_uint_eq(folded(0, 1e-9), 1);
    ck_assert_uint_eq(folded(0, .01), 2);
}
END_TEST

/* A tube of 24 strips, 15 degrees apart, is one surface though it faces all ways; its outside is another. */
START_TEST(neighbours_link) {
    enum { STRIPS = 24 };
    mesh m = {0};
    uint32_t surface[2 * STRIPS];
    for (int i = 0; i < STRIPS; i++) {
        const double a = 2 * M_PI * i / STRIPS, b = 2 * M_PI * (i + 1) / STRIPS;
        const double strip[4][3] = {
            {cos(a), sin(a), 0}, {cos(a), sin(a), 1}, {cos(b), sin(b), 1}, {cos(b), sin(b), 0}};
        mesh_add_quad(&m, strip);
    }
    mesh_finish(&m, .5f);
    ck_assert_uint_eq(surfaces_of(&m, surface), 1);
    ck_assert(mesh_make_two_sided(&m, &error) == LAM_OK);
    ck_assert_uint_eq(surfaces_of(&m, surface), 2);
    ck_assert_uint_eq(surface[STRIPS], 1);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("surfaces");
    TCase *tests = tcase_create("surfaces");
    tcase_set_timeout(tests, 120);
    tcase_add_test(tests, a_box_has_six);
    tcase_add_test(tests, a_fold_parts_from_30_degrees_on);
    tcase_add_test(tests, neighbours_link);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
