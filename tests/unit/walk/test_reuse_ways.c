/* The ways to the light of all positions beside each other where something hides: the same light, the same
 * bits by any number of threads, and the same refusal. */
#include "support/box.h"
#include "support/dense.h"
#include "support/moved_light.h"

#include <math.h>
#include <omp.h>

/* Where something hides, shared paths agree with paths of their own. */
START_TEST(rays_know_what_is_hidden) {
    mesh m = light_cornell();
    moving_light l = light_falling(&m);
    const bool from_light = _i == 0;
    reuse_estimates a = reuse_by(&m, &l, REUSE_NONE, 64000, 0, 3),
                    b = reuse_by(&m, &l, from_light ? REUSE_EXACT : REUSE_ELEMENTS, 16000, 0, 5);
    for (size_t k = 0; k < l.n * m.n_channels; k++) {
        double sum = 0, count = 0;
        for (size_t i = 0; i < m.n; i++) {
            const size_t at = k * m.n + i;
            const double both = hypot((double)a.error[at], (double)b.error[at]);
            if (!(both > 0)) continue;
            sum += pow(((double)a.H[at] - (double)b.H[at]) / both, 2);
            count++;
        }
        ck_assert_double_gt(count, .5 * (double)m.n);
        ck_assert_msg(sum / count < 31. / 29 + 5 * sqrt(2 / count), "row %zu: %g of %g", k, sum / count,
                      count);
    }
    reuse_estimates_free(&a);
    reuse_estimates_free(&b);
    moving_light_free(&l);
    mesh_free(&m);
}
END_TEST

/* |H~ - H| / |H| over all positions and elements. */
static double distance(const reuse_estimates *e, const reuse_estimates *of, const mesh *m) {
    double off = 0, all = 0;
    for (size_t k = 0; k < of->n_channels * of->n_positions * of->n; k++) {
        const double a = m->area[k % of->n];
        off += a * pow((double)e->H[k] - (double)of->H[k], 2);
        all += a * pow((double)of->H[k], 2);
    }
    return sqrt(off / all);
}

/* Maps are biased, the less the finer they are and the smaller the light is. */
START_TEST(maps_come_close) {
    const reuse_way way = _i == 0 ? REUSE_MAPS : REUSE_CUBES;
    mesh m = light_cornell();
    moving_light l = light_falling(&m);
    for (size_t k = 0; k < l.n_corners; k++)
        for (int d = 0; d < 3; d++) l.corner[k][d] *= .02;
    l.area *= .0004;
    reuse_estimates exact = reuse_by(&m, &l, REUSE_EXACT, 32000, 0, 3),
                    coarse = reuse_by(&m, &l, way, 32000, 4, 3), fine = reuse_by(&m, &l, way, 32000, 256, 3);
    const double far = distance(&coarse, &exact, &m), near = distance(&fine, &exact, &m);
    ck_assert_msg(near < .02 && near < .3 * far, "%g at 256 cells, %g at 4", near, far);
    reuse_estimates_free(&exact);
    reuse_estimates_free(&coarse);
    reuse_estimates_free(&fine);
    moving_light_free(&l);
    mesh_free(&m);
}
END_TEST

/* The same light with a fifth corner on one of its sides, which makes it one that has no parts. */
static moving_light undivided(const moving_light *l) {
    static const double corners[5][3] = {{0, 0, 0}, {0, .25, 0}, {.25, .25, 0}, {.25, .125, 0}, {.25, 0, 0}};
    moving_light out;
    lam_error error = {.message = ""};
    double(*corner)[3] = test_allocate(5, sizeof *corner);
    memcpy(corner, corners, sizeof corners);
    ck_ok(moving_light_create(5, corner, &out, &error));
    out.n = l->n;
    out.pose = test_allocate(l->n, sizeof *out.pose);
    for (size_t k = 0; k < l->n; k++) {
        out.pose[k] = l->pose[k];
        out.pose[k].name = strdup("a position");
    }
    memcpy(out.emission, l->emission, sizeof out.emission);
    return out;
}

/* Parts of a large light have maps of their own, as many cells in all, and less bias. */
START_TEST(parts_of_a_large_light_lower_the_bias) {
    const reuse_way way = _i == 0 ? REUSE_MAPS : REUSE_CUBES;
    mesh m = light_cornell();
    moving_light l = light_curved(&m), whole = undivided(&l);
    double off[2];
    for (int k = 0; k < 2; k++) {
        const moving_light *of = k == 0 ? &l : &whole;
        reuse_estimates exact = reuse_by(&m, of, REUSE_EXACT, 8000, 0, 3),
                        near = reuse_by(&m, of, way, 8000, 256, 3);
        off[k] = distance(&near, &exact, &m);
        reuse_estimates_free(&exact);
        reuse_estimates_free(&near);
    }
    ck_assert_msg(off[0] < .6 * off[1], "%g in parts, %g as a whole", off[0], off[1]);
    moving_light_free(&l);
    moving_light_free(&whole);
    mesh_free(&m);
}
END_TEST

START_TEST(bits_do_not_depend_on_threads) {
    static const reuse_way ways[] = {REUSE_NONE, REUSE_EXACT, REUSE_MAPS, REUSE_CUBES, REUSE_ELEMENTS};
    mesh m = light_cornell();
    moving_light l = light_falling(&m);
    const int threads = omp_get_max_threads();
    const reuse_problem problem = {
        .light = &l, .way = ways[_i], .even = true, .paths = 3200, .resolution = 32, .seed = 2};
    omp_set_num_threads(1);
    reuse_estimates one = reuse_solve(&m, &problem);
    omp_set_num_threads(3);
    reuse_estimates three = reuse_solve(&m, &problem);
    omp_set_num_threads(threads);
    const size_t size = m.n * m.n_channels * l.n;
    ck_assert_mem_eq(one.H, three.H, size * sizeof *one.H);
    ck_assert_mem_eq(one.error, three.error, size * sizeof *one.error);
    ck_assert_mem_eq(one.direct, three.direct, m.n * l.n * sizeof *one.direct);
    ck_assert_mem_eq(one.covariance, three.covariance, l.n * l.n * sizeof *one.covariance);
    ck_assert_double_eq(one.rays, three.rays);
    reuse_estimates_free(&one);
    reuse_estimates_free(&three);
    moving_light_free(&l);
    mesh_free(&m);
}
END_TEST

START_TEST(a_position_that_sees_nothing_is_refused) {
    mesh m = box_mesh(light_box, LIGHT_DIVISIONS, .6f);
    moving_light l = light_square();
    walk_scene *s = NULL;
    reuse_estimates e;
    lam_error error = {.message = ""};
    const reuse_problem problem = {.light = &l, .way = REUSE_EXACT, .paths = 64, .seed = 1};
    l.pose[2].move[2] = -3; /* below the floor, which it sees nothing of */
    ck_ok(walk_scene_create(&m, CLOSURE_MEASURED, &s, &error));
    ck_assert_int_eq(walk_reuse(s, &problem, &e, &error), LAM_ERR_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(error.message, "position 2 (a position)"));
    walk_scene_free(s);
    moving_light_free(&l);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("reuse_ways");
    TCase *tests = tcase_create("reuse_ways");
    tcase_set_timeout(tests, 300);
    tcase_add_loop_test(tests, rays_know_what_is_hidden, 0, 2);
    tcase_add_loop_test(tests, maps_come_close, 0, 2);
    tcase_add_loop_test(tests, parts_of_a_large_light_lower_the_bias, 0, 2);
    tcase_add_loop_test(tests, bits_do_not_depend_on_threads, 0, 5);
    tcase_add_test(tests, a_position_that_sees_nothing_is_refused);
    suite_add_tcase(suite, tests);
    return suite_run_together(suite);
}
