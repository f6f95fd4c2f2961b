/* The sides of panes, as files have them: each place has a front and a back, one of each. */
#include "solver/scene/glass.h"
#include "support/scene.h"
#include "support/suite.h"

#include <stdlib.h>

static char folder[64];

static void setup(void) {
    folder_make(folder);
    mtl_write(folder, "newmtl glass\nKd 0 0 0\nd 0.2\nnewmtl wall\nKd 0.5 0.5 0.5\n");
}

static void teardown(void) {
    folder_remove(folder);
}

#define SQUARE "mtllib scene.mtl\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 1 0 0\nv 1 2 0\n"

/* Makes the faces of a square, and returns how many of them get a back. */
static size_t backs_of(const char *faces, size_t n) {
    char text[1024];
    import_report found;
    glass_report report;
    lam_error error;
    size_t backs = 0;
    snprintf(text, sizeof text, SQUARE "%s", faces);
    mesh m = obj_good(folder, text, &found);
    ck_assert_uint_eq(m.n, n);
    ck_assert_int_eq(mesh_settle_glass(&m, &report, &error), LAM_OK);
    for (size_t i = 0; i < m.n; i++) backs += m.has_back[i];
    mesh_free(&m);
    return backs;
}

START_TEST(a_pane_has_a_back_unless_others_are_its_back) {
    static const struct {
        const char *faces;
        size_t n, backs;
    } cases[] = {
        {"usemtl glass\nf 1 2 3 4\n", 1, 1},
        {"usemtl glass\nf 1 2 3 4\nf 4 3 2 1\n", 2, 0},
        {"usemtl glass\nf 1 2 3 4\no other\nusemtl glass\nf 3 2 1 4\n", 2, 0}, /* of another group */
        {"usemtl glass\nf 1 2 3\nf 1 3 4\nf 2 1 3\nf 3 1 4\n", 4, 0},          /* along the same diagonal */
        {"usemtl glass\nf 1 2 3\nf 1 3 4\nf 4 2 1\nf 4 3 2\n", 4, 0},          /* along the other one */
        {"usemtl glass\nf 1 2 3 4\nf 4 2 1\nf 4 3 2\n", 3, 0},
        {"usemtl glass\nf 1 2 3 4\nf 4 6 5 1\nf 6 3 2 5\n", 3, 0},
        {"usemtl glass\nf 1 2 3 4\nf 4 6 5 1\n", 2, 1},              /* half of its back */
        {"usemtl glass\nf 1 2 3 4\nusemtl wall\nf 4 3 2 1\n", 2, 1}, /* a wall is no back of it */
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++)
        ck_assert_msg(backs_of(cases[k].faces, cases[k].n) == cases[k].backs, "%s", cases[k].faces);
}
END_TEST

/* --glass glass=0 leaves a scene with panes that has no pane. */
START_TEST(panes_that_are_made_opaque) {
    const struct group_glass opaque = {0, 1};
    import_report found;
    glass_report report;
    lam_error error;
    mesh m = obj_good(folder, SQUARE "usemtl glass\nf 1 2 3 4\nf 4 3 2 1\n", &found);
    ck_assert_ptr_nonnull(m.glass);
    for (size_t g = 0; g < m.n_groups; g++) ck_assert_int_eq(mesh_set_glass(&m, g, &opaque, &error), LAM_OK);
    ck_assert_int_eq(mesh_settle_glass(&m, &report, &error), LAM_OK);
    ck_assert_uint_eq(report.faces, 0);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("pane_sides");
    TCase *tests = tcase_create("pane_sides");
    tcase_add_checked_fixture(tests, setup, teardown);
    tcase_add_test(tests, a_pane_has_a_back_unless_others_are_its_back);
    tcase_add_test(tests, panes_that_are_made_opaque);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
