#include "support/closed_box.h"

#include "solver/method/reference.h"
#include "support/building.h"
#include "support/dense.h"

#include <math.h>

closed_box closed_box_make(const double size[3], unsigned divisions, float reflectance) {
    closed_box s = {.f = fixture_box(size, divisions, reflectance)};
    s.problem = *problem_of(&s.f);
    s.problem.F = &s.f.F;
    s.centre = test_allocate(s.f.m.n, sizeof *s.centre);
    for (size_t i = 0; i < s.f.m.n; i++) mesh_centroid(&s.f.m, i, s.centre[i]);
    return s;
}

void closed_box_free(closed_box *s) {
    free(s->centre);
    fixture_free(&s->f);
}

const build_problem *closed_box_problem(closed_box *s) {
    s->problem = *problem_of(&s->f);
    s->problem.centre = (const double(*)[3])s->centre;
    s->problem.normal = (const float(*)[3])s->f.m.normal;
    return &s->problem;
}

lam_operator *hierarchical_good(const build_problem *problem, double epsilon, build_report *report) {
    const build_options options = options_with("hierarchical", epsilon);
    lam_operator *op = NULL;
    lam_error error = {.message = ""};
    ck_ok(build_operator(problem, &options, &op, report, &error));
    return op;
}

double indirect_error(const build_problem *problem, const lam_operator *op, const float *w, const float *E) {
    const size_t n = problem->n, bytes = lam_operator_work_bytes(op, 1);
    reference *r = NULL;
    double *e = test_allocate(n, sizeof *e), *B = test_allocate(n, sizeof *B), wrong = 0, all = 0;
    float *out = test_allocate(n, sizeof *out);
    void *work = test_allocate(1, bytes);
    lam_error error = {.message = ""};
    for (size_t i = 0; i < n; i++) e[i] = (double)E[i];
    ck_ok(reference_create(problem->F, problem->area, problem->reflectance, REFERENCE_DENSE, &r, &error));
    ck_ok(reference_solve(r, 1, e, B, 1e-12, NULL, &error));
    ck_ok(lam_operator_apply(op, 1, LAM_RADIOSITY, E, out, work, bytes, &error));
    for (size_t i = 0; i < n; i++) {
        const double weight = problem->area[i] * (w != NULL ? (double)w[i] : 1);
        wrong += weight * pow((double)out[i] - B[i], 2);
        all += weight * pow(B[i] - e[i], 2);
    }
    reference_destroy(r);
    free(e);
    free(B);
    free(out);
    free(work);
    return sqrt(wrong / all);
}
