/* Meshes by preset, against the closed form of a floor below a lamp. */
#include "solver/adapt/mesh_fit.h"
#include "support/floor_lamp.h"
#include "support/suite.h"

#include <math.h>
#include <omp.h>

/* A mesh that keeps the error stays as it is, by its bits. */
START_TEST(fit_leaves_what_is_fine) {
    mesh m = floor_lamp_mesh(40), as_it_was = floor_lamp_mesh(40);
    const mesh_fit_options how = {.error = .05, .elements = 40000, .effort = 1, .seed = 1};
    mesh_fit_report report;
    lam_error error = {0};
    ck_ok(mesh_fit(&m, &how, &report, &error));
    const double off = floor_lamp_error(&m, NULL);
    printf("1600 elements leave %g, estimated %g\n", off, report.left.lamps);
    ck_assert(report.reached && report.way == MESH_FIT_FACES && report.left.has_lamps &&
              !report.left.has_sky);
    ck_assert_double_eq_tol(report.left.lamps, off, .2 * off);
    ck_assert_uint_eq(m.n, as_it_was.n);
    ck_assert_mem_eq(m.vertices, as_it_was.vertices, m.n_vertices * sizeof *m.vertices);
    ck_assert_mem_eq(m.elements, as_it_was.elements, m.n * sizeof *m.elements);
    mesh_free(&as_it_was);
    mesh_free(&m);
}
END_TEST

/* A coarse mesh is divided until it keeps the error, to a fifth: evenly where few elements do, and by the
 * light where an even division would take more than may be; the same for any number of threads. */
START_TEST(fit_keeps_the_error) {
    static const double asked[] = {.05, .025};
    static const size_t most[] = {40000, 1500};
    mesh m[2];
    mesh_fit_report report;
    lam_error error = {0};
    for (int k = 0; k < 2; k++) {
        const mesh_fit_options how = {.error = asked[_i], .elements = most[_i], .effort = 1, .seed = 1};
        omp_set_num_threads(k == 0 ? 1 : 5);
        m[k] = floor_lamp_mesh(1);
        const double before = floor_lamp_error(&m[k], NULL);
        ck_ok(mesh_fit(&m[k], &how, &report, &error));
        const double off = floor_lamp_error(&m[k], NULL);
        printf("%g: %zu elements leave %g, estimated %g, even %g\n", asked[_i], m[k].n, off,
               report.left.lamps, report.left.even);
        ck_assert(report.reached);
        ck_assert_int_eq(report.way, _i == 0 ? MESH_FIT_EVEN : MESH_FIT_LIGHT);
        /* A share of all light, where the true one is of that of the means. */
        const double share = before / sqrt(1 + before * before);
        ck_assert_double_eq_tol(report.faces.lamps, share, .15 * share);
        ck_assert_double_le(off, 1.2 * asked[_i]);
    }
    ck_assert_uint_eq(m[0].n_vertices, m[1].n_vertices);
    ck_assert_mem_eq(m[0].vertices, m[1].vertices, m[0].n_vertices * sizeof *m[0].vertices);
    for (int k = 0; k < 2; k++) mesh_free(&m[k]);
}
END_TEST

/* No more elements than may be; what they leave is told, and is not what was asked for. */
START_TEST(fit_within_elements) {
    mesh m = floor_lamp_mesh(1);
    const mesh_fit_options how = {.error = .001, .elements = 300, .effort = 1, .seed = 1};
    mesh_fit_report report;
    lam_error error = {0};
    ck_ok(mesh_fit(&m, &how, &report, &error));
    ck_assert(!report.reached);
    ck_assert_uint_gt(m.n, 150);
    ck_assert_uint_le(m.n, 330);
    ck_assert_double_eq_tol(report.left.lamps, floor_lamp_error(&m, NULL), .2 * report.left.lamps);
    mesh_free(&m);
}
END_TEST

/* Below an even sky a floor without any shadow is as bright everywhere: nothing is divided for the sky, and
 * its error is stated; beside the plate it is darker, and the mesh finer. */
START_TEST(fit_to_a_sky) {
    const coarse_sky sky = {.ground_albedo = 0};
    mesh m = floor_lamp_mesh(1);
    mesh_fit_report with, without;
    lam_error error = {0};
    mesh_fit_options how = {.error = .05, .elements = 40000, .effort = 1, .seed = 1};
    for (size_t i = 0; i < m.n; i++) m.emission[i] = 0;
    mesh dark = floor_lamp_mesh(1);
    for (size_t i = 0; i < dark.n; i++) dark.emission[i] = 0;
    ck_ok(mesh_fit(&dark, &how, &without, &error));
    how.from.sky = &sky;
    ck_ok(mesh_fit(&m, &how, &with, &error));
    printf("a sky: %g before, %g after, %zu elements\n", with.faces.sky, with.left.sky, m.n);
    ck_assert(with.left.has_sky && !with.left.has_lamps && !without.left.has_sky);
    ck_assert_double_gt(with.faces.sky, 0);
    ck_assert_double_le(with.left.sky, .05);
    ck_assert_double_eq_tol(with.left.even, without.left.even, .05);
    mesh_free(&dark);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *s = suite_create("mesh_fit");
    TCase *c = tcase_create("all");
    tcase_set_timeout(c, 300);
    tcase_add_test(c, fit_leaves_what_is_fine);
    tcase_add_loop_test(c, fit_keeps_the_error, 0, 2);
    tcase_add_test(c, fit_within_elements);
    tcase_add_test(c, fit_to_a_sky);
    suite_add_tcase(s, c);
    return suite_run(s);
}
