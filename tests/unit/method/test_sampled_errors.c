/* The errors by which auto compares operators, of a sample of rows: elements of very unlike areas, of which
 * the small ones receive by large numbers of the inverse and emit by small ones. */
#include "solver/base/random.h"
#include "solver/method/choice.h"
#include "solver/method/reference.h"
#include "solver/method/sparse/sparse_inverse.h"
#include "support/box_problem.h"
#include "support/building.h"

#include <math.h>
#include <string.h>

enum { N = 1200, OF_FLOOR = 10 };
static const double splinter = 1e-3;

static void add_entry(csr *F, size_t row, size_t column, double value) {
    F->indices[F->indptr[row + 1]] = (uint32_t)column;
    F->data[F->indptr[row + 1]++] = (float)value;
}

/* Floors of area 1 in pairs that see each other by .5, and above each nine splinters that see it by .5. */
static fixture splinters(uint32_t *group) {
    fixture f = {.m = {.n = N, .n_channels = 1}};
    lam_error error = {0};
    f.F = (csr){.n = N, .indptr = calloc(N + 1, sizeof *f.F.indptr)};
    ck_assert_int_eq(csr_reserve(&f.F, 2 * (size_t)N, &error), LAM_OK);
    f.order = malloc(N * sizeof *f.order);
    f.m.area = malloc(N * sizeof *f.m.area);
    f.m.reflectance = malloc(N * sizeof *f.m.reflectance);
    for (size_t i = 0; i < N; i++) {
        const size_t under = i / OF_FLOOR * OF_FLOOR, across = (i / OF_FLOOR ^ 1) * OF_FLOOR;
        f.F.indptr[i + 1] = f.F.indptr[i];
        if (i != under) {
            add_entry(&f.F, i, under, .5);
        } else {
            if (across < under) add_entry(&f.F, i, across, .5);
            for (size_t k = 1; k < OF_FLOOR; k++) add_entry(&f.F, i, under + k, .5 * splinter);
            if (across > under) add_entry(&f.F, i, across, .5);
        }
        f.order[i] = (uint32_t)i;
        f.m.area[i] = i == under ? 1 : splinter;
        f.m.reflectance[i] = .8f;
        group[i] = i != under;
    }
    return f;
}

/* The errors of single elements and of groups, by LU in double. */
static sampled_errors errors_by_reference(const build_problem *p, const lam_operator *op, size_t count) {
    lam_error error = {0};
    reference *r = NULL;
    sampled_errors found = {0};
    const size_t n = p->n, bytes = lam_operator_work_bytes(op, 1), lights = count + 2;
    double *E = calloc(lights * n, sizeof *E), *B = calloc(lights * n, sizeof *B);
    float *one = calloc(n, sizeof *one), *out = calloc(n, sizeof *out);
    void *work = malloc(bytes);
    for (size_t v = 0; v < count; v++) E[v * n + p->order[v * n / count]] = 1;
    for (size_t i = 0; i < n; i++) E[(count + p->group[i]) * n + i] = 1;
    ck_assert_int_eq(reference_create(p->F, p->area, p->reflectance, REFERENCE_DENSE, &r, &error), LAM_OK);
    ck_assert_int_eq(reference_solve(r, lights, E, B, 0, NULL, &error), LAM_OK);
    for (size_t v = 0; v < lights; v++) {
        double missing = 0, light = 0;
        for (size_t i = 0; i < n; i++) one[i] = (float)E[v * n + i];
        ck_assert_int_eq(lam_operator_apply(op, 1, LAM_INDIRECT, one, out, work, bytes, &error), LAM_OK);
        for (size_t i = 0; i < n; i++) {
            const double x = B[v * n + i] - E[v * n + i];
            bool read = v < count;
            for (size_t k = 0; k < count; k++) read = read || p->order[k * n / count] == i;
            if (!read) continue; /* groups are told by the sampled elements */
            missing += p->area[i] * pow(x - (double)out[i], 2);
            light += p->area[i] * x * x;
        }
        *(v < count ? &found.single : &found.groups) +=
            sqrt(missing / light) / (double)(v < count ? count : lights - count);
    }
    reference_destroy(r);
    free(E);
    free(B);
    free(one);
    free(out);
    free(work);
    return found;
}

static lam_operator *sparse_of(const build_problem *p, double threshold) {
    lam_error error = {0};
    lam_operator *op = NULL;
    build_report report;
    build_options how = build_presets("sparse");
    set_number(&how, "threshold", threshold);
    ck_assert_msg(build_operator(p, &how, &op, &report, &error) == LAM_OK, "%s", error.message);
    return op;
}

/* Allowed is the 1e-5 that the rows are solved to. Estimates of a sparse inverse know no bounces that it
 * drops one by one: they are lower bounds of the errors of emitters. */
START_TEST(errors_are_those_of_the_reference) {
    uint32_t group[N];
    fixture f = splinters(group);
    build_problem p = *problem_of(&f);
    p.group = group;
    p.n_groups = 2;
    lam_error error = {0};
    inverse_rows rows;
    sampled_errors errors;
    sparse_sample sample;
    ck_assert_int_eq(inverse_rows_find(&p, p.reflectance, NULL, &rows, &error), LAM_OK);
    for (double threshold = 1e-2; threshold > 1e-7; threshold /= 10) {
        const sparse_limits limits = {.threshold = threshold, .whole_black = true};
        lam_operator *op = sparse_of(&p, threshold);
        const sampled_errors truth = errors_by_reference(&p, op, rows.count);
        ck_assert_int_eq(operator_sampled_errors(&p, op, &rows, &errors, &error), LAM_OK);
        ck_assert_int_eq(sparse_inverse_sample(&p, p.reflectance, &limits, &rows, &sample, &error), LAM_OK);
        printf("threshold %g: single %.4g by %.4g (%.4g), groups %.4g by %.4g (%.4g)\n", threshold,
               truth.single, errors.single, sample.errors.single, truth.groups, errors.groups,
               sample.errors.groups);
        ck_assert_double_eq_tol(errors.single, truth.single, 1e-4);
        ck_assert_double_eq_tol(errors.groups, truth.groups, 1e-4);
        ck_assert_double_eq_tol(sample.errors.groups, truth.groups, 1e-4);
        ck_assert_double_le(sample.errors.single, 1.05 * truth.single + 1e-4);
        if (threshold > .5 * splinter) ck_assert_double_gt(sample.errors.single, .7);
        lam_operator_close(op);
    }
    ck_assert_double_lt(errors.single, 1e-3);
    inverse_rows_free(&rows);
    fixture_free(&f);
}
END_TEST

/* Places of elements that say nothing of who sees whom. */
static void place_anywhere(build_problem *p, double (*centre)[3], float (*normal)[3]) {
    uint64_t state = 11;
    for (size_t i = 0; i < N; i++) {
        normal[i][2] = 1;
        for (int d = 0; d < 2; d++) centre[i][d] = (double)(random_lcg(&state) >> 40);
    }
    p->centre = (const double(*)[3])centre;
    p->normal = (const float(*)[3])normal;
}

/* A threshold that keeps all that splinters receive loses all that they emit, .0004 of it a floor: either one
 * is found that keeps both, or another method is taken. A threshold that is given stays, and its error is a
 * reason for another method, although it would take less time. */
START_TEST(errors_come_before_time) {
    uint32_t group[N];
    static double centre[N][3];
    static float normal[N][3];
    fixture f = splinters(group);
    build_problem p = *problem_of(&f);
    lam_error error = {0};
    p.group = group;
    p.n_groups = 2;
    place_anywhere(&p, centre, normal);
    for (int given = 0; given < 2; given++) {
        decision d;
        lam_operator *op = NULL;
        build_report report;
        build_options how = build_presets("auto");
        if (given) set_number(&how, "threshold", 1e-2);
        ck_assert_msg(choose_method(&p, &how, false, &d, &error) == LAM_OK, "%s", error.message);
        printf("%s: %s\n", d.taken->method->name, d.reason);
        ck_assert_int_eq(build_operator(&p, &how, &op, &report, &error), LAM_OK);
        ck_assert_str_eq(report.method, d.taken->method->name);
        const candidate *sparse = decision_find(&d, "sparse");
        const sampled_errors truth = errors_by_reference(&p, op, 32);
        ck_assert_double_le(truth.single, how.epsilon);
        ck_assert_double_le(truth.groups, how.epsilon);
        if (given) {
            ck_assert_double_gt(candidate_error(&d, sparse), .4);
            ck_assert_double_lt(sparse->cost, d.taken->cost);
            ck_assert_ptr_nonnull(strstr(d.reason, "err by"));
        }
        lam_operator_close(op);
        decision_free(&d);
    }
    fixture_free(&f);
}
END_TEST

/* Where groups are not known, what splinters emit is kept all the same. */
START_TEST(emitters_are_kept_without_groups) {
    uint32_t group[N];
    static double centre[N][3];
    static float normal[N][3];
    fixture f = splinters(group);
    build_problem p = *problem_of(&f);
    lam_error error = {0};
    decision d;
    const build_options how = build_presets("auto");
    place_anywhere(&p, centre, normal);
    ck_assert_int_eq(choose_method(&p, &how, true, &d, &error), LAM_OK);
    const candidate *sparse = decision_find(&d, "sparse");
    ck_assert_double_lt(decision_figure(&d, "sparse", "threshold", 1), .5 * splinter);
    ck_assert_double_le(sparse->errors.single, how.epsilon);
    ck_assert_double_eq(sparse->errors.groups, 0);
    decision_free(&d);
    fixture_free(&f);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("sampled_errors");
    TCase *cases = tcase_create("sampled_errors");
    tcase_set_timeout(cases, 240);
    tcase_add_test(cases, errors_are_those_of_the_reference);
    tcase_add_test(cases, errors_come_before_time);
    tcase_add_test(cases, emitters_are_kept_without_groups);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
