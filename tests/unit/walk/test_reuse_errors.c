/* The errors that estimates of reused paths state, against those that they have, and counts of paths that
 * even them out. */
#include "support/box.h"
#include "support/dense.h"
#include "support/moved_light.h"

#include <math.h>

/* w' K w. */
static double quadratic(const double *K, const double w[LIGHT_POSITIONS]) {
    double sum = 0;
    for (size_t j = 0; j < LIGHT_POSITIONS; j++)
        for (size_t k = 0; k < LIGHT_POSITIONS; k++) sum += w[j] * w[k] * K[j * LIGHT_POSITIONS + k];
    return sum;
}

/* The stated error of a mix beside its mean square around the mean of 32 seeds, in the norm that it is stated
 * in. A path meets four elements, so that at least 24 of 96 deviate by themselves: the squares of a mix have
 * the relative standard deviation sqrt(2 / (31 * 24)), of which 4 are allowed. The first two positions share
 * most paths, so that the error of their difference is far below that of independent estimates. */
START_TEST(covariance_is_that_of_seeds) {
    enum { SEEDS = 32, MIXES = 6 };
    static const double mix[MIXES][LIGHT_POSITIONS] = {{1, 0, 0, 0},  {0, 0, 0, 1},  {1, 1, 1, 1},
                                                       {1, -1, 0, 0}, {.5, 0, 2, 0}, {0, 1, -1, 1}};
    static const reuse_way ways[] = {REUSE_NONE, REUSE_EXACT, REUSE_ELEMENTS};
    const reuse_way way = ways[_i];
    mesh m = box_mesh(light_box, LIGHT_DIVISIONS, .6f);
    moving_light l = light_square();
    reuse_estimates e[SEEDS];
    double stated[MIXES] = {0}, apart = 0, mean[LIGHT_POSITIONS];
    for (size_t r = 0; r < SEEDS; r++) {
        e[r] = reuse_by(&m, &l, way, 3200, 0, r + 1);
        for (size_t k = 0; k < MIXES; k++) stated[k] += quadratic(e[r].covariance, mix[k]) / SEEDS;
        for (size_t j = 0; j < 2; j++) apart += e[r].covariance[j * LIGHT_POSITIONS + j] / SEEDS;
        for (size_t j = 0; j < LIGHT_POSITIONS; j++) {
            double sum = 0;
            for (size_t i = 0; i < m.n; i++) sum += m.area[i] * pow(.6 * (double)e[r].error[j * m.n + i], 2);
            ck_assert_double_eq_tol(e[r].covariance[j * LIGHT_POSITIONS + j], sum, 1e-5 * sum);
        }
    }
    for (size_t k = 0; k < MIXES; k++) {
        double found = 0;
        for (size_t i = 0; i < m.n; i++) {
            for (size_t j = 0; j < LIGHT_POSITIONS; j++) {
                mean[j] = 0;
                for (size_t r = 0; r < SEEDS; r++) mean[j] += (double)e[r].H[j * m.n + i] / SEEDS;
            }
            for (size_t r = 0; r < SEEDS; r++) {
                double off = 0;
                for (size_t j = 0; j < LIGHT_POSITIONS; j++)
                    off += mix[k][j] * ((double)e[r].H[j * m.n + i] - mean[j]);
                found += m.area[i] * pow(.6 * off, 2) / (SEEDS - 1);
            }
        }
        ck_assert_msg(fabs(found / stated[k] - 1) < 4 * sqrt(2. / (31 * 24)), "mix %zu: %g for %g", k, found,
                      stated[k]);
    }
    if (way != REUSE_NONE) ck_assert_msg(stated[3] < .5 * apart, "%g of %g", stated[3], apart);
    for (size_t r = 0; r < SEEDS; r++) reuse_estimates_free(&e[r]);
    moving_light_free(&l);
    mesh_free(&m);
}
END_TEST

/* Covariances of groups add up to the whole one, and that of their means is the spread of the means over
 * seeds: of 8 groups and 12 positions and channels, many alike, 24 seeds; the mean of the squares is sure to
 * a fifth. */
START_TEST(means_of_groups_scatter_as_stated) {
    enum { SEEDS = 24 };
    const reuse_way way = _i == 0 ? REUSE_EXACT : REUSE_ELEMENTS;
    mesh m = light_cornell();
    moving_light l = light_falling(&m);
    const size_t s = l.n, C = m.n_channels, G = m.n_groups;
    double *sum = test_allocate(G * s * C, sizeof *sum), *squares = test_allocate(G * s * C, sizeof *squares);
    double *area = test_allocate(G, sizeof *area), stated = 0, found = 0;
    for (size_t i = 0; i < m.n; i++) area[m.group[i]] += m.area[i];
    for (size_t r = 0; r < SEEDS; r++) {
        reuse_estimates e = reuse_by(&m, &l, way, 1600, 0, r + 1);
        double whole = 0, parts = 0;
        for (size_t g = 0; g < G; g++)
            for (size_t k = 0; k < s; k++) {
                stated += e.of_means[(g * s + k) * s + k] * area[g] * area[g] / SEEDS;
                parts += e.of_groups[(g * s + k) * s + k];
                for (size_t c = 0; c < C; c++) {
                    double mean = 0;
                    for (size_t i = 0; i < m.n; i++)
                        if (m.group[i] == g)
                            mean += m.area[i] * (double)m.reflectance[c * m.n + i] *
                                    (double)e.H[(c * s + k) * m.n + i];
                    sum[(g * s + k) * C + c] += mean / SEEDS;
                    squares[(g * s + k) * C + c] += mean * mean / SEEDS;
                }
            }
        for (size_t k = 0; k < s; k++) whole += e.covariance[k * s + k];
        ck_assert_double_eq_tol(parts, whole, 1e-9 * whole);
        reuse_estimates_free(&e);
    }
    for (size_t k = 0; k < G * s * C; k++) found += (squares[k] - sum[k] * sum[k]) * SEEDS / (SEEDS - 1.);
    ck_assert_msg(found > .7 * stated && found < 1.4 * stated, "%g for %g", found, stated);
    free(sum);
    free(squares);
    free(area);
    moving_light_free(&l);
    mesh_free(&m);
}
END_TEST

static double largest(const reuse_estimates *e) {
    double most = 0;
    for (size_t k = 0; k < e->n_positions; k++) most = fmax(most, e->covariance[k * (e->n_positions + 1)]);
    return most;
}

/* Counts of paths by a pilot: as many in all, more of the positions whose errors are largest. The stated
 * squares of errors are sums over elements with a relative standard deviation below .1 each. */
START_TEST(counts_even_out_errors) {
    mesh m = light_cornell();
    moving_light l = light_curved(&m);
    reuse_problem problem = {.light = &l, .way = REUSE_EXACT, .paths = 6400, .seed = 4};
    reuse_estimates same = reuse_solve(&m, &problem);
    problem.even = true;
    reuse_estimates even = reuse_solve(&m, &problem);
    size_t sum = 0, most = 0;
    for (size_t k = 0; k < l.n; k++) {
        ck_assert_uint_eq(same.count[k], 6400);
        sum += even.count[k];
        most = even.count[k] > most ? even.count[k] : most;
    }
    ck_assert_double_eq_tol((double)sum, 6400. * (double)l.n, .5 * WALK_BATCHES * (double)l.n);
    ck_assert_uint_gt(most, 6400);
    ck_assert_msg(largest(&even) < .85 * largest(&same), "%g of %g", largest(&even), largest(&same));
    reuse_estimates_free(&same);
    reuse_estimates_free(&even);
    moving_light_free(&l);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("reuse_errors");
    TCase *tests = tcase_create("reuse_errors");
    tcase_set_timeout(tests, 300);
    tcase_add_loop_test(tests, covariance_is_that_of_seeds, 0, 3);
    tcase_add_loop_test(tests, means_of_groups_scatter_as_stated, 0, 2);
    tcase_add_test(tests, counts_even_out_errors);
    suite_add_tcase(suite, tests);
    return suite_run_together(suite);
}
