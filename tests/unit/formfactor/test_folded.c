/* Faces of a plane that are a little turned against each other, as the halves of a quad whose corners are
 * rounded: by blocks neither hides what the other sees. */
#include "support/blocks.h"
#include "support/scene.h"
#include "support/suite.h"

static lam_error error;

/* F between unit squares one above the other (plates_cases of plates.h). */
static const double wanted = .199824895698;

/* A unit square below another one, its corners moved up and down by h in turn: two triangles that meet along
 * a diagonal, or with a seam across them two triangles and two halves of others. */
static mesh folded(double h, bool seam) {
    char text[1024], folder[64];
    import_report report;
    const mesh_refinement fine = {.elements = 600};
    snprintf(text, sizeof text,
             "o below\nv 0 0 %.9g\nv 1 0 %.9g\nv 1 1 %.9g\nv 0 1 %.9g\n%so above\nv 0 0 1\nv 1 0 1\nv 1 1 "
             "1\nv 0 1 "
             "1\nf -1 -2 -3 -4\n",
             -h, h, -h, h, seam ? "v .5 .5 0\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n" : "f 1 2 3\nf 1 3 4\n");
    folder_make(folder);
    mesh m = obj_good(folder, text, &report);
    folder_remove(folder);
    ck_ok(mesh_refine(&m, &fine, &error));
    return m;
}

START_TEST(halves_hide_nothing) {
    static const double heights[] = {0, 1e-7, 1e-6, 3e-6, 1e-5, 1e-4, 5e-4};
    const double h = heights[_i % 7];
    mesh m = folded(h, _i >= 7);
    plane_tree tree;
    block_report report;
    block_factors blocks = blocks_of(&m, &tree, blocks_open, blocks_shadow, &report);
    size_t below = 0;
    double area = 0, between = 0;
    while (strcmp(m.group_names[m.group[below]], "below") == 0) below++;
    double *x = calloc(m.n, sizeof *x), *y = calloc(m.n, sizeof *y);
    for (size_t i = below; i < m.n; i++) x[i] = 1;
    blocks_multiply(&blocks, x, y);
    for (size_t i = 0; i < below; i++) {
        area += m.area[i];
        between += m.area[i] * y[i];
        ck_assert_double_gt(y[i], .13); /* at a corner it is .1385 */
    }
    ck_assert_double_eq_tol(between / area, wanted, 5e-4 + 2 * h);
    free(x);
    free(y);
    block_factors_free(&blocks);
    plane_tree_free(&tree);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("folded");
    TCase *tests = tcase_create("folded");
    tcase_add_loop_test(tests, halves_hide_nothing, 0, 14);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
