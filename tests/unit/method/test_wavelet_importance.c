/* The hierarchical operator of elements of which some are read: what these err by, and what it costs. */
#include "solver/base/random.h"
#include "solver/method/reference.h"
#include "support/box_problem.h"
#include "support/building.h"
#include "support/dense.h"
#include "support/suite.h"

#include <math.h>

static lam_error error;

/* A box and where its elements are. */
typedef struct closed {
    fixture f;
    build_problem problem;
    double (*centre)[3];
} closed;

static closed closed_make(const double size[3], unsigned divisions, float reflectance) {
    closed s = {.f = fixture_box(size, divisions, reflectance)};
    s.problem = *problem_of(&s.f);
    s.problem.F = &s.f.F;
    s.centre = test_allocate(s.f.m.n, sizeof *s.centre);
    for (size_t i = 0; i < s.f.m.n; i++) mesh_centroid(&s.f.m, i, s.centre[i]);
    return s;
}

/* The problem as it lies now. */
static const build_problem *of(closed *s) {
    s->problem = *problem_of(&s->f);
    s->problem.centre = (const double(*)[3])s->centre;
    s->problem.normal = (const float(*)[3])s->f.m.normal;
    return &s->problem;
}

static void closed_free(closed *s) {
    free(s->centre);
    fixture_free(&s->f);
}

static lam_operator *build(const build_problem *problem, double epsilon, build_report *report) {
    const build_options options = options_with("hierarchical", epsilon);
    lam_operator *op = NULL;
    ck_ok(build_operator(problem, &options, &op, report, &error));
    return op;
}

/* Errors and light of elements that are read: sums of A w (B~ - B)^2 and of A w (B - E)^2. */
static double read_error(const build_problem *problem, const lam_operator *op, const float *w,
                         const float *E) {
    const size_t n = problem->n, bytes = lam_operator_work_bytes(op, 1);
    reference *r = NULL;
    double *e = test_allocate(n, sizeof *e), *B = test_allocate(n, sizeof *B), wrong = 0, all = 0;
    float *out = test_allocate(n, sizeof *out);
    void *work = test_allocate(1, bytes);
    for (size_t i = 0; i < n; i++) e[i] = (double)E[i];
    ck_ok(reference_create(problem->F, problem->area, problem->reflectance, REFERENCE_DENSE, &r, &error));
    ck_ok(reference_solve(r, 1, e, B, 1e-12, NULL, &error));
    ck_ok(lam_operator_apply(op, 1, LAM_RADIOSITY, E, out, work, bytes, &error));
    for (size_t i = 0; i < n; i++) {
        wrong += problem->area[i] * (double)w[i] * pow((double)out[i] - B[i], 2);
        all += problem->area[i] * (double)w[i] * pow(B[i] - e[i], 2);
    }
    reference_destroy(r);
    free(e);
    free(B);
    free(out);
    free(work);
    return sqrt(wrong / all);
}

/* Where a fifth of a wall is read, its light errs no more than an operator of everything does, within a tenth
 * (they drop other coefficients), with half of the coefficients; elsewhere it is only roughly right:
 * thresholds of K are at most 16 times as large there, and what is dropped at most as much. */
START_TEST(what_is_read_is_as_good_for_fewer_coefficients) {
    closed s = closed_make(room, 14, .7f);
    const build_problem *problem = of(&s);
    const size_t n = problem->n, wall = n / 6;
    build_problem some = *problem;
    importance read = {.n = n, .read = test_allocate(n, sizeof(float))};
    float *E = test_allocate(4 * n, sizeof *E), *ones = test_allocate(n, sizeof *ones);
    uint64_t seed = 2;
    for (size_t i = 0; i < n; i++) ones[i] = 1;
    for (size_t i = 0; i < wall / 5; i++) read.read[i] = 1;
    const factor_product F = factor_product_of_rows(problem->F);
    ck_ok(importance_find(&F, 1, problem->reflectance, &read, &error));
    some.importance = &read;
    E[n / 2] = E[n + n - 1] = 1;
    for (size_t i = 0; i < n; i++) {
        E[2 * n + i] = i > n / 2 && i < n / 2 + 40 ? 1 : 0;
        E[3 * n + i] = (float)random_lcg_unit(&seed);
    }
    build_report report;
    operator_description about[2];
    lam_operator *all = build(problem, .02, &report), *part = build(&some, .02, &report);
    operator_describe(all, &about[0]);
    operator_describe(part, &about[1]);
    ck_assert_double_lt(about[1].density, .5 * about[0].density);
    double errors[2] = {0, 0};
    for (int light = 0; light < 4; light++) {
        errors[0] += read_error(problem, all, read.read, E + light * n);
        errors[1] += read_error(problem, part, read.read, E + light * n);
        const double whole = read_error(problem, all, ones, E + light * n);
        const double rough = read_error(problem, part, ones, E + light * n);
        ck_assert_double_lt(rough, 16 * whole);
        ck_assert_double_gt(rough, whole);
    }
    ck_assert_double_gt(errors[0], 0);
    ck_assert_double_lt(errors[1], 1.1 * errors[0]);
    lam_operator_close(all);
    lam_operator_close(part);
    importance_free(&read);
    free(E);
    free(ones);
    closed_free(&s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("wavelet importance");
    TCase *cases = tcase_create("wavelet importance");
    tcase_set_timeout(cases, 120);
    tcase_add_test(cases, what_is_read_is_as_good_for_fewer_coefficients);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
