/* The hierarchical operator of boxes with exact form factors: how near it comes, and what it says of itself.
 */
#include "solver/base/random.h"
#include "solver/formfactor/source.h"
#include "solver/method/reference.h"
#include "solver/operator/hierarchical.h"
#include "solver/precompute/forecast/forecast.h"
#include "support/building.h"
#include "support/closed_box.h"
#include "support/dense.h"
#include "support/random_blocks.h"
#include "support/suite.h"

#include <math.h>

static lam_error error;

/* One element, a part of a wall, all of it: a smaller epsilon keeps more and is nearer, and error goes with
 * it. */
START_TEST(epsilon_is_what_it_costs) {
    closed_box s = closed_box_make(room, 14, .7f); /* 1,176 elements */
    const build_problem *problem = closed_box_problem(&s);
    const size_t n = problem->n;
    const double epsilons[] = {.1, .02, .002}, most[3] = {.12, .04, .006};
    float *E = test_allocate(3 * n, sizeof *E);
    uint64_t seed = 2;
    double density = 0;
    E[n / 5] = 1;
    for (size_t i = 0; i < n; i++) {
        E[n + i] = i > n / 2 && i < n / 2 + 40 ? 1 : 0;
        E[2 * n + i] = (float)random_lcg_unit(&seed);
    }
    for (int k = 0; k < 3; k++) {
        build_report report;
        operator_description about;
        lam_operator *op = hierarchical_good(problem, epsilons[k], &report);
        operator_describe(op, &about);
        ck_assert_double_gt(about.density, 1.2 * density);
        density = about.density;
        /* Half of it is stored, four bytes a number. */
        const build_options how = options_with("hierarchical", epsilons[k]);
        const forecast f = {.n = n,
                            .n_channels = 1,
                            .recipe = {.source = &source_pairs},
                            .method = method_find("hierarchical"),
                            .build = &how};
        const forecast without = {.n = n, .n_channels = 1, .recipe = f.recipe};
        const double stored = 2 * density * (double)n * (double)n;
        const double foreseen = forecast_store_bytes(&f) - forecast_store_bytes(&without);
        ck_assert_double_ge(foreseen, stored);
        ck_assert_double_le(foreseen, 8 * stored);
        for (int light = 0; light < 3; light++)
            ck_assert_double_lt(indirect_error(problem, op, NULL, E + light * n), most[k]);
        ck_assert_double_eq_tol(report_get(&report, "threshold", -1), .02 * epsilons[k], 1e-12);
        ck_assert_double_lt(report_get(&report, "uniform_error", -1), .1 * epsilons[k]);
        ck_assert_double_lt(report_get(&report, "probe_residual", -1), epsilons[k]);
        ck_assert_str_eq(report.method, "hierarchical");
        ck_assert_ptr_nonnull(strstr(report.reason, "6 planes"));
        lam_operator_close(op);
    }
    free(E);
    closed_box_free(&s);
}
END_TEST

/* Where nothing reflects irradiance is there all the same, and where nearly all does nothing grows. */
START_TEST(black_and_white) {
    closed_box s = closed_box_make(unit_cube, 8, .97f);
    const build_problem *problem = closed_box_problem(&s);
    const size_t n = problem->n;
    build_report report;
    for (size_t i = 0; i < n; i += 3) s.f.m.reflectance[i] = 0;
    lam_operator *op = hierarchical_good(problem, .002, &report);
    float *E = test_allocate(n, sizeof *E), *H = test_allocate(n, sizeof *H);
    double *B = test_allocate(n, sizeof *B), *truth = test_allocate(n, sizeof *truth), largest = 0;
    void *work = test_allocate(1, lam_operator_work_bytes(op, 1));
    for (size_t i = 0; i < n; i++) E[i] = i % 5 == 0 ? 1 : 0;
    ck_assert_double_lt(indirect_error(problem, op, NULL, E), .01);
    ck_ok(lam_operator_apply(op, 1, LAM_RADIOSITY, E, H, work, lam_operator_work_bytes(op, 1), &error));
    for (size_t i = 0; i < n; i++) {
        if (i % 3 == 0) ck_assert(H[i] == E[i]);
        B[i] = (double)H[i];
    }
    csr_multiply_rows(problem->F, 0, n, 1, B, truth);
    ck_ok(lam_operator_apply(op, 1, LAM_IRRADIANCE, E, H, work, lam_operator_work_bytes(op, 1), &error));
    for (size_t i = 0; i < n; i++) largest = fmax(largest, truth[i]);
    for (size_t i = 0; i < n; i++) ck_assert(fabs((double)H[i] - truth[i]) < .02 * largest);
    lam_operator_close(op);
    free(E);
    free(H);
    free(B);
    free(truth);
    free(work);
    closed_box_free(&s);
}
END_TEST

/* Of three channels the first and the last reflect alike, and in the second turn all: these answer with the
 * same bits, and as a grey scene does where there are no others, whose numbers steps of rounding fit too. */
START_TEST(alike_channels_share_an_operator) {
    closed_box s = closed_box_make(unit_cube, 6, .5f);
    const build_problem *problem = closed_box_problem(&s);
    const size_t n = problem->n, middle = _i == 0 ? 1 : 0;
    build_problem colour = *problem;
    build_report report;
    float *rho = test_allocate(3 * n, sizeof *rho), *E = test_allocate(3 * n, sizeof *E),
          *B = test_allocate(3 * n, sizeof *B), *grey = test_allocate(n, sizeof *grey);
    for (size_t i = 0; i < n; i++) {
        rho[i] = rho[2 * n + i] = problem->reflectance[i];
        rho[n + i] = _i == 0 ? .7f : problem->reflectance[i];
        E[i] = E[n + i] = E[2 * n + i] = i % 7 == 0 ? 1 : 0;
    }
    colour.n_channels = 3;
    colour.reflectance = rho;
    lam_operator *op = hierarchical_good(&colour, .01, &report);
    const hierarchical *const made = (const hierarchical *)op;
    ck_assert_uint_eq(made->of_channel[1], middle);
    ck_assert_uint_eq(made->of_channel[2], 0);
    ck_assert_uint_eq(made->K[2].n, 0);
    ck_assert_ptr_nonnull(strstr(report.reason, "share"));
    void *work = test_allocate(1, lam_operator_work_bytes(op, 1));
    ck_ok(lam_operator_apply(op, 1, LAM_RADIOSITY, E, B, work, lam_operator_work_bytes(op, 1), &error));
    ck_assert_mem_eq(B, B + 2 * n, n * sizeof *B);
    lam_operator *alone = hierarchical_good(problem, .01, &report);
    ck_assert_ptr_null(strstr(report.reason, "share"));
    ck_ok(lam_operator_apply(alone, 1, LAM_RADIOSITY, E, grey, work, lam_operator_work_bytes(alone, 1),
                             &error));
    for (size_t i = 0; i < n; i++) ck_assert_double_eq_tol((double)B[i], (double)grey[i], 1e-3);
    if (_i == 1) ck_assert_mem_eq(B + n, grey, n * sizeof *grey);
    ck_assert(_i == 1 || memcmp(B, B + n, n * sizeof *B) != 0);
    lam_operator_close(alone);
    lam_operator_close(op);
    free(rho);
    free(E);
    free(B);
    free(grey);
    free(work);
    closed_box_free(&s);
}
END_TEST

/* A coefficient below the noise of rays is not kept, whatever epsilon asks for. */
START_TEST(noise_sets_the_threshold) {
    closed_box s = closed_box_make(unit_cube, 6, .5f);
    build_report report;
    (void)closed_box_problem(&s);
    s.problem.noise = .2;
    lam_operator_close(hierarchical_good(&s.problem, .01, &report));
    /* The rows sum to 1, to 1e-6 in single precision. */
    ck_assert_double_eq_tol(report_get(&report, "threshold", -1), .055 * .2, 1e-6 * .055 * .2);
    ck_assert_ptr_nonnull(strstr(report.reason, "noise"));
    closed_box_free(&s);
}
END_TEST

/* Where planes have fewer than 12 elements the threshold falls with their number, to a third at most, by the
 * noise of rays as by epsilon: a face of a cube has 1, 4, 9 and 36. */
START_TEST(small_planes_lower_the_threshold) {
    static const unsigned divisions[] = {1, 2, 3, 6};
    static const double share[] = {1. / 3, 1. / 3, 9. / 12, 1};
    for (size_t k = 0; k < sizeof share / sizeof *share; k++) {
        closed_box s = closed_box_make(unit_cube, divisions[k], .5f);
        build_report report;
        (void)closed_box_problem(&s);
        s.problem.noise = .2;
        lam_operator_close(hierarchical_good(&s.problem, .01, &report));
        /* The rows sum to 1, to 1e-6 in single precision. */
        ck_assert_double_eq_tol(report_get(&report, "threshold", -1), share[k] * .055 * .2, 1e-6 * .055 * .2);
        lam_operator_close(hierarchical_good(&s.problem, 1, &report));
        ck_assert_double_eq_tol(report_get(&report, "threshold", -1), share[k] * .02, 1e-6 * .02);
        closed_box_free(&s);
    }
}
END_TEST

/* The threshold of scenes whose rows are small falls with the square of the Frobenius norm of S, so that
 * single elements err by no more than where rows are full: here a fifth of those of a cube. */
START_TEST(small_rows_lower_the_threshold) {
    static const double share = .2, epsilon = .05;
    closed_box s = closed_box_make(unit_cube, 8, .5f);
    build_report report;
    double error_of[2];
    for (int k = 0; k < 2; k++) {
        const build_problem *problem = closed_box_problem(&s);
        const size_t n = problem->n;
        const csr *F = problem->F;
        double square = 0;
        for (size_t i = 0; i < n; i++)
            for (uint64_t e = F->indptr[i]; e < F->indptr[i + 1]; e++)
                square += pow((double)F->data[e], 2) * problem->area[i] / problem->area[F->indices[e]];
        lam_operator *op = hierarchical_good(problem, epsilon, &report);
        const double least = 1.5 * 1.5, expected = .02 * epsilon * fmin(square / least, 1);
        ck_assert_double_eq_tol(report_get(&report, "threshold", -1), expected, 1e-9 * expected);
        ck_assert_int_eq(square < least, k == 1);
        float *E = test_allocate(n, sizeof *E);
        for (size_t i = 0; i < n; i++) E[i] = i == 5;
        error_of[k] = indirect_error(problem, op, NULL, E);
        free(E);
        lam_operator_close(op);
        for (uint64_t e = 0; e < F->indptr[n]; e++) s.f.F.data[e] *= (float)share;
    }
    ck_assert_double_le(error_of[1], 1.2 * error_of[0]);
    closed_box_free(&s);
}
END_TEST

/* The threshold by the noise of a scene, over the one that the recipe's noise alone would set. */
static double share_of_recipe(closed_box *s) {
    build_report report;
    s->problem.noise = .2;
    lam_operator_close(hierarchical_good(&s->problem, .001, &report));
    return report_get(&report, "threshold", -1) / (.055 * .2);
}

/* The noise is that of the rows: the root of the mean of sum_j 2 A_i F_ij / (A_i + A_j). */
START_TEST(noise_is_that_of_the_rows) {
    closed_box s = closed_box_make(unit_cube, 6, .5f);
    const build_problem *problem = closed_box_problem(&s);
    const size_t n = problem->n;
    csr *F = &s.f.F;
    build_report report;
    double *area = s.f.m.area, sum = 0;
    /* Rows of a closed scene of equal elements sum to 1, to 1e-6 in single precision. */
    ck_assert_double_eq_tol(share_of_recipe(&s), 1, 1e-6);
    /* A quarter of every row, and half of the noise. */
    for (uint64_t e = 0; e < F->indptr[n]; e++) F->data[e] *= .25f;
    ck_assert_double_eq_tol(share_of_recipe(&s), .5, 1e-6);
    /* And half of the threshold by epsilon, where that is above the noise. */
    lam_operator_close(hierarchical_good(problem, 1, &report));
    ck_assert_double_eq_tol(report_get(&report, "threshold", -1), .5 * .02, 1e-6 * .5 * .02);
    /* Small elements beside large ones, and the same S_ij = (A_i / A_j)^1/2 F_ij: a term is that times
     * 2 (A_i A_j)^1/2 / (A_i + A_j), here 8/17 between both sizes. */
    for (size_t i = 0; i < n; i++) area[i] *= i % 3 == 0 ? 1 : 1. / 16;
    for (size_t i = 0; i < n; i++)
        for (uint64_t e = F->indptr[i]; e < F->indptr[i + 1]; e++) {
            const size_t j = F->indices[e];
            sum += (double)F->data[e] * ((i % 3 == 0) == (j % 3 == 0) ? 1 : 8. / 17);
            F->data[e] *= (float)sqrt(area[j] / area[i]);
        }
    ck_assert_double_eq_tol(share_of_recipe(&s), sqrt(sum / (double)n), 1e-6);
    ck_assert_double_lt(share_of_recipe(&s), .45);
    /* Where nothing sees anything a threshold is left. */
    for (uint64_t e = 0; e < F->indptr[n]; e++) F->data[e] = 0;
    ck_assert_double_eq_tol(share_of_recipe(&s), .1, 1e-12);
    closed_box_free(&s);
}
END_TEST

/* F of the problem as blocks of two elements, on a tree that the caller frees. It is not the one that the
 * method makes for rows, whose leaves are larger. */
static block_factors blocks_of(const build_problem *problem, plane_tree *tree) {
    block_factors f;
    ck_ok(plane_tree_make(problem->n, problem->centre, problem->normal, NULL, NULL, 4, tree, &error));
    ck_ok(block_factors_begin(tree, problem->area, problem->centre, &f, &error));
    blocks_of_pairs(problem->F, &f);
    ck_ok(block_factors_end(&f, &error));
    return f;
}

/* Largest difference of the irradiance by two operators, over the largest irradiance. */
static double apart(const lam_operator *a, const lam_operator *b, size_t n, const float *E) {
    const size_t bytes = lam_operator_work_bytes(a, 1);
    float *x = test_allocate(n, sizeof *x), *y = test_allocate(n, sizeof *y);
    void *work = test_allocate(1, bytes);
    double most = 0, largest = 0;
    ck_ok(lam_operator_apply(a, 1, LAM_IRRADIANCE, E, x, work, bytes, &error));
    ck_ok(lam_operator_apply(b, 1, LAM_IRRADIANCE, E, y, work, bytes, &error));
    for (size_t i = 0; i < n; i++) most = fmax(most, fabs((double)x[i] - (double)y[i]));
    for (size_t i = 0; i < n; i++) largest = fmax(largest, fabs((double)y[i]));
    free(x);
    free(y);
    free(work);
    return most / largest;
}

/* The operator is the one of the same F as rows; a balance gives it the row sums that it must have. */
START_TEST(blocks_in_place_of_rows) {
    closed_box s = closed_box_make(room, 10, .6f);
    const build_problem *problem = closed_box_problem(&s);
    const size_t n = problem->n;
    plane_tree tree;
    block_factors f = blocks_of(problem, &tree);
    build_report of_rows, of_blocks;
    build_problem other = *problem;
    float *E = test_allocate(2 * n, sizeof *E), *H = test_allocate(n, sizeof *H);
    void *work;
    uint64_t seed = 6;
    other.F = NULL;
    other.blocks = &f;
    for (size_t i = 0; i < n; i++) {
        E[i] = (float)random_lcg_unit(&seed);
        E[n + i] = i / 40 == 3;
    }
    /* At these epsilons both keep coefficients from the same size on. */
    lam_operator *rows = hierarchical_good(problem, .0004, &of_rows),
                 *blocks = hierarchical_good(&other, .002, &of_blocks);
    for (size_t light = 0; light < 2; light++) {
        ck_assert_double_lt(indirect_error(problem, blocks, NULL, E + light * n), .006);
        ck_assert_double_lt(apart(blocks, rows, n, E + light * n), .1 * .002);
    }
    /* Of blocks more terms of the products are left out. */
    ck_assert_double_lt(report_get(&of_blocks, "probe_residual", -1),
                        2 * report_get(&of_rows, "probe_residual", -1));
    ck_assert_double_lt(report_get(&of_blocks, "uniform_error", -1), 1e-6);
    lam_operator_close(rows);
    lam_operator_close(blocks);
    /* Rows of sums s: E = 1 - rho s makes B = 1, H = s. */
    double *ones = test_allocate(n, sizeof *ones), *sums = test_allocate(n, sizeof *sums);
    f.balance = test_allocate(n, sizeof *f.balance);
    for (size_t p = 0; p < n; p++) f.balance[p] = .98 + .04 * random_lcg_unit(&seed);
    for (size_t p = 0; p < n; p++) ones[p] = 1;
    ck_ok(block_factors_multiply(&f, 1, ones, sums, &error));
    for (size_t p = 0; p < n; p++)
        E[f.order[p]] = (float)(1 - (double)problem->reflectance[f.order[p]] * sums[p]);
    blocks = hierarchical_good(&other, .002, &of_blocks);
    work = test_allocate(1, lam_operator_work_bytes(blocks, 1));
    ck_ok(lam_operator_apply(blocks, 1, LAM_IRRADIANCE, E, H, work, lam_operator_work_bytes(blocks, 1),
                             &error));
    double most = 0;
    for (size_t p = 0; p < n; p++) most = fmax(most, fabs((double)H[f.order[p]] - sums[p]));
    /* Sums differ by up to .02. They are imposed, so that nothing is left to correct. */
    ck_assert_ptr_null(strstr(of_blocks.reason, "corrected"));
    ck_assert_double_lt(most, .001);
    ck_assert_double_lt(report_get(&of_blocks, "probe_residual", -1), .002);
    ck_assert_double_lt(report_get(&of_blocks, "uniform_error", -1), .1 * .002);
    lam_operator_close(blocks);
    block_factors_free(&f);
    plane_tree_free(&tree);
    free(E);
    free(H);
    free(work);
    free(ones);
    free(sums);
    closed_box_free(&s);
}
END_TEST

/* Blocks are for methods that can use them. */
START_TEST(blocks_need_their_method) {
    closed_box s = closed_box_make(unit_cube, 4, .5f);
    build_problem problem = *closed_box_problem(&s);
    plane_tree tree;
    block_factors f = blocks_of(&problem, &tree);
    build_options options = build_presets("exact");
    build_report report;
    lam_operator *op = NULL;
    problem.F = NULL;
    problem.blocks = &f;
    ck_assert_int_eq(build_operator(&problem, &options, &op, &report, &error), LAM_ERR_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(error.message, "exact"));
    options = build_presets("auto");
    ck_ok(build_set(&options, "rank", "10", &error));
    ck_assert_int_eq(build_operator(&problem, &options, &op, &report, &error), LAM_ERR_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(error.message, "low-rank"));
    options = build_presets("auto");
    ck_ok(build_operator(&problem, &options, &op, &report, &error));
    ck_assert_str_eq(report.method, "hierarchical");
    lam_operator_close(op);
    block_factors_free(&f);
    plane_tree_free(&tree);
    closed_box_free(&s);
}
END_TEST

START_TEST(it_wants_to_know_where_elements_are) {
    closed_box s = closed_box_make(unit_cube, 2, .5f);
    const build_options options = build_presets("hierarchical");
    build_report report;
    lam_operator *op = NULL;
    ck_assert_int_eq(build_operator(problem_of(&s.f), &options, &op, &report, &error), LAM_ERR_ARGUMENT);
    ck_assert_ptr_null(op);
    closed_box_free(&s);
}
END_TEST

/* Many small numbers that are left out are much of the light that is everywhere: it is given back, to E0 all
 * of it, and a threshold that loses little leaves it as it is. */
START_TEST(even_light_is_made_up_for) {
    closed_box s = closed_box_make(room, 14, .5f);
    const build_problem *problem = closed_box_problem(&s);
    const size_t n = problem->n;
    float *E = test_allocate(n, sizeof *E), *lit = test_allocate(n, sizeof *lit);
    uint64_t seed = 8;
    build_report report;
    lam_operator *coarse, *fine;
    /* An open scene: half of every row is gone, here and there, and what is left is noise. */
    csr F = s.f.F;
    for (size_t i = 0; i < n; i++)
        for (uint64_t e = F.indptr[i]; e < F.indptr[i + 1]; e++) {
            const size_t j = F.indices[e];
            if ((i + j) * 2654435761u % 1000 < 800) F.data[e] = 0;
        }
    coarse = hierarchical_good(problem, .9, &report);
    ck_assert_ptr_nonnull(strstr(report.reason, "the mean error of uniform emission is corrected"));
    /* Half precision, of what was missing. */
    ck_assert_double_lt(report_get(&report, "uniform_error", -1), 1e-3);
    for (size_t i = 0; i < n; i++) {
        lit[i] = (float)random_lcg_unit(&seed);
        E[i] = i % 2 == 0 ? 1.0f : .5f;
    }
    ck_assert_double_lt(indirect_error(problem, coarse, NULL, E), .1);
    ck_assert_double_lt(indirect_error(problem, coarse, NULL, lit), .2);
    fine = hierarchical_good(problem, .002, &report);
    ck_assert_ptr_null(strstr(report.reason, "uniform emission"));
    free(E);
    free(lit);
    lam_operator_close(coarse);
    lam_operator_close(fine);
    closed_box_free(&s);
}
END_TEST

/* Some elements, chosen in any sequence, more than once, or more than there are, are what they are among all.
 */
START_TEST(some_elements) {
    static const size_t counts[] = {1, 3, 40, 2500};
    closed_box s = closed_box_make(room, 20, .5f);
    const build_problem *problem = closed_box_problem(&s);
    const size_t n = problem->n;
    build_report report;
    lam_operator *op = hierarchical_good(problem, .05, &report);
    const size_t bytes = lam_operator_work_bytes(op, 3);
    void *work = test_allocate(1, bytes);
    float *E = test_allocate(3 * n, sizeof *E), *all = test_allocate(3 * n, sizeof *all),
          *some = test_allocate(3 * 2500, sizeof *some);
    uint32_t *which = test_allocate(2500, sizeof *which);
    uint64_t seed = 4;
    ck_assert_uint_eq(n, 2400);
    E[n / 7] = 2; /* one element, a wall, every element */
    for (size_t i = 0; i < n; i++) {
        E[n + i] = problem->normal[i][2] > .5f ? 1 : 0;
        E[2 * n + i] = (float)random_lcg_unit(&seed);
    }
    ck_ok(lam_operator_apply(op, 3, LAM_INDIRECT, E, all, work, bytes, &error));
    for (size_t k = 0; k < sizeof counts / sizeof *counts; k++) {
        for (size_t r = 0; r < counts[k]; r++) which[r] = (uint32_t)(random_lcg_unit(&seed) * (double)n);
        if (counts[k] == 3) which[2] = which[0];
        memset(work, 0xA5, bytes);
        ck_ok(lam_operator_apply_selected(op, 3, LAM_INDIRECT, E, NULL, counts[k], which, some, work, bytes,
                                          &error));
        for (size_t v = 0; v < 3; v++)
            for (size_t r = 0; r < counts[k]; r++)
                ck_assert(some[v * counts[k] + r] == all[v * n + which[r]]);
        ck_assert(some[0] > 0);
    }
    free(E);
    free(all);
    free(some);
    free(which);
    free(work);
    lam_operator_close(op);
    closed_box_free(&s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("hierarchical");
    TCase *tests = tcase_create("operator");
    tcase_set_timeout(tests, 300);
    tcase_add_test(tests, epsilon_is_what_it_costs);
    tcase_add_test(tests, black_and_white);
    tcase_add_loop_test(tests, alike_channels_share_an_operator, 0, 2);
    tcase_add_test(tests, noise_sets_the_threshold);
    tcase_add_test(tests, small_planes_lower_the_threshold);
    tcase_add_test(tests, small_rows_lower_the_threshold);
    tcase_add_test(tests, noise_is_that_of_the_rows);
    tcase_add_test(tests, even_light_is_made_up_for);
    tcase_add_test(tests, some_elements);
    tcase_add_test(tests, blocks_in_place_of_rows);
    tcase_add_test(tests, blocks_need_their_method);
    tcase_add_test(tests, it_wants_to_know_where_elements_are);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
