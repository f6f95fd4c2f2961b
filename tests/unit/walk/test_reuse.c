/* The light of a moving light in an empty box, by each unbiased way, against closed forms. */
#include "solver/method/reference.h"
#include "support/box.h"
#include "support/dense.h"
#include "support/moved_light.h"

/* The cell that a pose of the square covers. */
static box_cell cell_at(const light_pose *p, bool along_x) {
    box_cell c = {.axis = along_x ? 0 : 2, .level = p->move[along_x ? 0 : 2]};
    for (int d = 0; d < 3; d++) {
        c.from[d] = p->move[d];
        c.to[d] = p->move[d] + (d == c.axis ? 0 : .25);
    }
    return c;
}

/* The light that comes straight from the square, exactly, [s][n], of the emission 1. */
static double *exact_direct(const mesh *m, const moving_light *l) {
    double *direct = test_allocate(LIGHT_POSITIONS * m->n, sizeof *direct);
    for (size_t k = 0; k < LIGHT_POSITIONS; k++) {
        const box_cell light = cell_at(&l->pose[k], k == 3);
        for (size_t i = 0; i < m->n; i++) {
            const box_cell cell = box_cell_of(light_box, LIGHT_DIVISIONS, i);
            const int a = light.axis;
            /* In front of the light lies what is below it, or beyond it along x. */
            const bool before =
                a == 0 ? cell.from[0] >= light.level - 1e-12 : cell.to[2] <= light.level + 1e-12;
            const bool same = cell.axis == a && fabs(cell.level - light.level) < 1e-12;
            direct[k * m->n + i] = before && !same ? box_exchange(&cell, &light) / m->area[i] : 0;
        }
    }
    return direct;
}

/* Irradiance H [s][n] in the empty box, exactly: first light by closed forms, and all bounces. */
static double *exact_light(const mesh *m, const moving_light *l, const csr *F) {
    const size_t n = m->n;
    double *H = test_allocate(LIGHT_POSITIONS * n, sizeof *H),
           *E = test_allocate(LIGHT_POSITIONS * n, sizeof *E);
    reference *r = NULL;
    lam_error error = {.message = ""};
    double *direct = exact_direct(m, l);
    for (size_t k = 0; k < LIGHT_POSITIONS * n; k++)
        H[k] = E[k] = (double)m->reflectance[k % n] * l->emission[0] * direct[k];
    ck_ok(reference_create(F, m->area, m->reflectance, REFERENCE_DENSE, &r, &error));
    ck_ok(reference_solve(r, LIGHT_POSITIONS, E, H, 1e-12, NULL, &error));
    for (size_t k = 0; k < LIGHT_POSITIONS * n; k++) H[k] /= (double)m->reflectance[k % n];
    reference_destroy(r);
    free(direct);
    free(E);
    return H;
}

/* The mean square of (H~ - H) / error over elements that have an error, of one position. */
static double chi_square(const reuse_estimates *e, size_t position, const double *H) {
    double sum = 0, count = 0;
    for (size_t i = 0; i < e->n; i++) {
        const size_t k = position * e->n + i;
        ck_assert(e->error[k] > 0);
        sum += pow(((double)e->H[k] - H[k]) / (double)e->error[k], 2);
        count++;
    }
    return sum / count;
}

/* Errors from 32 batches are Student's, whose square has the mean 31 / 29; 96 elements of a position, which
 * are not independent. */
START_TEST(agrees_with_closed_forms) {
    const reuse_way way = _i == 0 ? REUSE_NONE : REUSE_EXACT;
    mesh m = box_mesh(light_box, LIGHT_DIVISIONS, .6f);
    csr F = box_form_factors(light_box, LIGHT_DIVISIONS, m.area);
    moving_light l = light_square();
    double *H = exact_light(&m, &l, &F);
    const reuse_problem problem = {.light = &l, .way = way, .even = _i == 2, .paths = 40000, .seed = 7};
    reuse_estimates e = reuse_solve(&m, &problem);
    ck_assert_uint_eq(e.paths % WALK_BATCHES, 0);
    ck_assert_double_ge(e.rays, 1 / (1 - .6) - .1);
    for (size_t k = 0; k < LIGHT_POSITIONS; k++) {
        const double chi = chi_square(&e, k, H);
        ck_assert_msg(chi > .5 && chi < 31. / 29 + 5 * sqrt(2. / 96), "position %zu: %g", k, chi);
    }
    reuse_estimates_free(&e);
    free(H);
    moving_light_free(&l);
    csr_free(&F);
    mesh_free(&m);
}
END_TEST

/* Elements get a part p of the power of the light. No path has a weight above 1 / N, so that the variance of
 * an estimate of p is at most p / N, of which 5 standard deviations of a chi-square of as many elements as
 * get light are allowed. */
START_TEST(direct_light_is_the_form_factor) {
    const reuse_way way = _i == 0 ? REUSE_NONE : REUSE_EXACT;
    mesh m = box_mesh(light_box, LIGHT_DIVISIONS, .6f);
    moving_light l = light_square();
    double *exact = exact_direct(&m, &l);
    reuse_estimates e = reuse_by(&m, &l, way, 40000, 0, 7);
    for (size_t k = 0; k < LIGHT_POSITIONS; k++) {
        double sum = 0, count = 0;
        for (size_t i = 0; i < m.n; i++) {
            const size_t at = k * m.n + i;
            const double part = exact[at] * m.area[i] / l.area, off = (double)e.direct[at] - exact[at];
            if (part == 0) ck_assert_double_eq((double)e.direct[at], 0);
            ck_assert_double_ge((double)e.H[at], l.emission[0] * (double)e.direct[at] * (1 - 1e-6));
            if (part < 1e-4) continue;
            sum += pow(off * m.area[i] / l.area, 2) * (double)e.paths / part;
            count++;
        }
        ck_assert_double_gt(count, 20);
        ck_assert_msg(sum / count < 1 + 5 * sqrt(2 / count), "position %zu: %g of %g", k, sum / count, count);
    }
    reuse_estimates_free(&e);
    free(exact);
    moving_light_free(&l);
    mesh_free(&m);
}
END_TEST

static double square_error(const reuse_estimates *e, size_t position, const double *H, const mesh *m) {
    double sum = 0;
    for (size_t i = 0; i < e->n; i++)
        sum += m->area[i] * pow((double)e->H[position * e->n + i] - H[position * e->n + i], 2);
    return sum;
}

/* Positions of the line share their paths: their errors fall, though each has as many paths of its own. */
START_TEST(sharing_lowers_the_error) {
    mesh m = box_mesh(light_box, LIGHT_DIVISIONS, .6f);
    csr F = box_form_factors(light_box, LIGHT_DIVISIONS, m.area);
    moving_light l = light_square();
    double *H = exact_light(&m, &l, &F), own = 0, shared = 0;
    for (uint64_t seed = 1; seed <= 8; seed++) {
        reuse_estimates a = reuse_by(&m, &l, REUSE_NONE, 6400, 0, seed),
                        b = reuse_by(&m, &l, REUSE_EXACT, 6400, 0, seed);
        for (size_t k = 0; k < 3; k++) {
            own += square_error(&a, k, H, &m);
            shared += square_error(&b, k, H, &m);
        }
        reuse_estimates_free(&a);
        reuse_estimates_free(&b);
    }
    ck_assert_msg(shared < .6 * own, "%g for %g", shared, own);
    free(H);
    moving_light_free(&l);
    csr_free(&F);
    mesh_free(&m);
}
END_TEST

/* Walks from elements: the mean square over elements and seeds is what is stated, and the power that all
 * elements receive, whose error is far smaller, is right on average (Student's distribution of 63 degrees).
 */
START_TEST(walks_from_elements_agree_with_closed_forms) {
    enum { SEEDS = 64 };
    mesh m = box_mesh(light_box, LIGHT_DIVISIONS, .6f);
    csr F = box_form_factors(light_box, LIGHT_DIVISIONS, m.area);
    moving_light l = light_square();
    double *H = exact_light(&m, &l, &F), *direct = exact_direct(&m, &l), off[LIGHT_POSITIONS][SEEDS];
    double found = 0, stated = 0, missed = 0, straight = 0;
    for (size_t r = 0; r < SEEDS; r++) {
        reuse_estimates e = reuse_by(&m, &l, REUSE_ELEMENTS, 3200, 0, r + 1);
        for (size_t k = 0; k < LIGHT_POSITIONS; k++) {
            found += square_error(&e, k, H, &m);
            off[k][r] = 0;
            for (size_t i = 0; i < m.n; i++) {
                const size_t at = k * m.n + i;
                stated += m.area[i] * pow((double)e.error[at], 2);
                missed += pow((double)e.direct[at] - direct[at], 2);
                straight += pow(direct[at], 2);
                off[k][r] += m.area[i] * ((double)e.H[at] - H[at]);
            }
        }
        reuse_estimates_free(&e);
    }
    ck_assert_msg(found > .7 * stated && found < 1.4 * stated, "%g for %g", found, stated);
    ck_assert_msg(missed < 1e-4 * straight, "%g of %g", missed, straight);
    for (size_t k = 0; k < LIGHT_POSITIONS; k++) {
        double mean = 0, spread = 0;
        for (size_t r = 0; r < SEEDS; r++) mean += off[k][r] / SEEDS;
        for (size_t r = 0; r < SEEDS; r++) spread += pow(off[k][r] - mean, 2) / (SEEDS * (SEEDS - 1.));
        ck_assert_msg(fabs(mean) < 4.5 * sqrt(spread), "position %zu: %g +- %g", k, mean, sqrt(spread));
    }
    free(H);
    free(direct);
    moving_light_free(&l);
    csr_free(&F);
    mesh_free(&m);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("reuse");
    TCase *tests = tcase_create("reuse");
    tcase_set_timeout(tests, 300);
    tcase_add_loop_test(tests, agrees_with_closed_forms, 0, 3);
    tcase_add_loop_test(tests, direct_light_is_the_form_factor, 0, 2);
    tcase_add_test(tests, sharing_lowers_the_error);
    tcase_add_test(tests, walks_from_elements_agree_with_closed_forms);
    suite_add_tcase(suite, tests);
    return suite_run_together(suite);
}
