/* The test of a finished hierarchical operator: it passes a good one, and notices a block with a wrong weight
 * that uniform radiosity does not show. */
#include "solver/method/hierarchical/self_check.h"
#include "support/closed_box.h"
#include "support/dense.h"
#include "support/suite.h"

#include <math.h>

enum { DIVISIONS = 8, FACE = DIVISIONS * DIVISIONS };
static const double epsilon = .02;

/* The first wall gets more from the opposite one, by this share, and as much less from the third wall, so
 * that rows have the sums that they had. */
static csr with_wrong_block(const csr *F, size_t n, double share) {
    csr out = {.indptr = test_allocate(n + 1, sizeof *out.indptr),
               .indices = test_allocate(F->indptr[n], sizeof *out.indices),
               .data = test_allocate(F->indptr[n], sizeof *out.data)};
    out.n = n;
    memcpy(out.indptr, F->indptr, (n + 1) * sizeof *out.indptr);
    memcpy(out.indices, F->indices, F->indptr[n] * sizeof *out.indices);
    memcpy(out.data, F->data, F->indptr[n] * sizeof *out.data);
    for (size_t i = 0; i < FACE; i++) {
        double to[2] = {0, 0};
        for (uint64_t p = F->indptr[i]; p < F->indptr[i + 1]; p++) {
            const size_t wall = F->indices[p] / FACE;
            if (wall == 1 || wall == 2) to[wall - 1] += (double)F->data[p];
        }
        for (uint64_t p = F->indptr[i]; p < F->indptr[i + 1]; p++) {
            const size_t wall = F->indices[p] / FACE;
            if (wall == 1) out.data[p] *= (float)(1 + share);
            if (wall == 2) out.data[p] *= (float)(1 - share * to[0] / to[1]);
        }
    }
    return out;
}

/* A wall that is a sixth of the area has a block of a fifth of its light that is off by half. */
START_TEST(wrong_block_is_noticed) {
    closed_box s = closed_box_make(unit_cube, DIVISIONS, .7f);
    build_problem problem = *closed_box_problem(&s);
    const size_t n = problem.n;
    build_report built, good = {.method = ""}, bad = {.method = ""};
    lam_error error = {.message = ""};
    double *row_sums = test_allocate(n, sizeof *row_sums);
    for (size_t i = 0; i < n; i++)
        for (uint64_t p = s.f.F.indptr[i]; p < s.f.F.indptr[i + 1]; p++) row_sums[i] += (double)s.f.F.data[p];
    lam_operator *op = hierarchical_good(&problem, epsilon, &built);
    ck_ok(self_check(&problem, row_sums, op, epsilon, 1, &good, &error));
    ck_assert(built.doubtful == 0 && good.doubtful == 0);
    ck_assert_double_gt(report_get(&good, "smooth_residual", -1), 0);
    ck_assert_double_lt(report_get(&good, "smooth_residual", -1), .2 * epsilon);
    csr wrong = with_wrong_block(&s.f.F, n, .5);
    problem.F = &wrong;
    ck_ok(self_check(&problem, row_sums, op, epsilon, 1, &bad, &error));
    ck_assert_double_gt(report_get(&bad, "smooth_residual", -1), epsilon);
    ck_assert_double_eq_tol(bad.doubtful, .5 * epsilon, 1e-12);
    /* The answer to uniform light is the operator's alone. */
    ck_assert(report_get(&bad, "uniform_error", -1) == report_get(&good, "uniform_error", -1));
    /* Noise of the form factors may explain it. */
    problem.noise = report_get(&bad, "smooth_residual", -1);
    bad.doubtful = 0;
    ck_ok(self_check(&problem, row_sums, op, epsilon, 1, &bad, &error));
    ck_assert(bad.doubtful == 0);
    csr_free(&wrong);
    lam_operator_close(op);
    free(row_sums);
    closed_box_free(&s);
}
END_TEST

/* Where nothing reflects there is nothing to be wrong about. */
START_TEST(black_walls) {
    closed_box s = closed_box_make(unit_cube, 4, 0);
    const build_problem *problem = closed_box_problem(&s);
    build_report built;
    lam_operator *op = hierarchical_good(problem, epsilon, &built);
    ck_assert(report_get(&built, "smooth_residual", -1) == 0);
    ck_assert(built.doubtful == 0);
    lam_operator_close(op);
    closed_box_free(&s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("self_check");
    TCase *tc = tcase_create("self_check");
    tcase_add_test(tc, wrong_block_is_noticed);
    tcase_add_test(tc, black_walls);
    suite_add_tcase(suite, tc);
    return suite_run(suite);
}
