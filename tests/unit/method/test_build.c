/* The builders and the reference against closed forms (exact form factors in, nine digits out). */
#include "solver/method/judge/judge.h"
#include "solver/method/low_rank/factorizer.h"
#include "solver/method/method.h"
#include "solver/method/reference.h"
#include "support/box_problem.h"
#include "support/building.h"
#include "support/followed.h"
#include "support/suite.h"

static build_options defaults(void) {
    return options_with("low-rank", .1);
}

static lam_operator *build(const build_problem *problem, const build_options *options, build_report *report) {
    lam_operator *op = NULL;
    lam_error error = {0};
    ck_assert_msg(build_operator(problem, options, &op, report, &error) == LAM_OK, "%s", error.message);
    return op;
}

static void apply(const lam_operator *op, lam_quantity quantity, const float *E, float *out) {
    const size_t bytes = lam_operator_work_bytes(op, 1);
    void *work = malloc(bytes);
    lam_error error = {0};
    ck_assert_msg(lam_operator_apply(op, 1, quantity, E, out, work, bytes, &error) == LAM_OK, "%s",
                  error.message);
    free(work);
}

/* Mean of x over the cells of a face. */
static double face_mean(const double *x, unsigned divisions, size_t face) {
    const size_t cells = (size_t)divisions * divisions;
    double sum = 0;
    for (size_t i = 0; i < cells; i++) sum += x[face * cells + i];
    return sum / (double)cells;
}

/* Unit cube, E = 1 on face x0, rho = .5: the exact values of the discrete problem. */
static const struct {
    unsigned divisions;
    double emitter, adjacent, opposite;
} cubes[] = {{1, 1.090909098, .181836269, .181745826},
             {4, 1.102645712, .181381216, .171829422},
             {16, 1.104210821, .181133371, .171255694}};

/* F is stored in single precision: relative rounding 6e-8 a factor, so 1e-7 in a mean of B. */
static const double tolerance = 1e-7;

START_TEST(reference_cube) {
    fixture f = fixture_box(unit_cube, cubes[_i].divisions, .5f);
    const size_t n = f.m.n, cells = n / 6;
    double *E = calloc(n, sizeof *E), *B = calloc(n, sizeof *B);
    for (size_t i = 0; i < cells; i++) E[i] = 1;
    for (int way = REFERENCE_DENSE; way <= REFERENCE_ITERATED; way++) {
        reference *r = NULL;
        lam_error error = {0};
        memcpy(B, E, n * sizeof *B);
        ck_assert_int_eq(reference_create(&f.F, f.m.area, f.m.reflectance, way, &r, &error), LAM_OK);
        ck_assert_msg(reference_solve(r, 1, E, B, 1e-11, NULL, &error) == LAM_OK, "%s", error.message);
        ck_assert_double_eq_tol(face_mean(B, cubes[_i].divisions, 0), cubes[_i].emitter, tolerance);
        ck_assert_double_eq_tol(face_mean(B, cubes[_i].divisions, 1), cubes[_i].opposite, tolerance);
        for (size_t face = 2; face < 6; face++)
            ck_assert_double_eq_tol(face_mean(B, cubes[_i].divisions, face), cubes[_i].adjacent, tolerance);
        reference_destroy(r);
    }
    free(E);
    free(B);
    fixture_free(&f);
}
END_TEST

/* An LU and conjugate gradients, which leave a residual of 1e-8 |u|, an error of at most 1 / (1 - rho) = 5
 * times that: one solution. */
START_TEST(both_ways_of_a_reference_agree) {
    enum { DIVISIONS = 8, N = 6 * DIVISIONS * DIVISIONS, M = 3 };
    fixture f = fixture_box(room, DIVISIONS, .8f);
    lam_error error = {0};
    double *E = calloc(M * N, sizeof *E), *B[2];
    for (size_t i = 0; i < N; i++) {
        E[N + i] = i % 7 == 0;
        E[2 * N + i] = 1;
    }
    E[5] = 1;
    for (int k = 0; k < 2; k++) {
        reference *r = NULL;
        B[k] = calloc(M * N, sizeof *B[k]);
        memcpy(B[k], E, M * N * sizeof *E);
        const reference_way way = k == 0 ? REFERENCE_DENSE : REFERENCE_ITERATED;
        ck_ok(reference_create(&f.F, f.m.area, f.m.reflectance, way, &r, &error));
        ck_ok(reference_solve(r, M, E, B[k], 1e-8, NULL, &error));
        reference_destroy(r);
    }
    for (size_t v = 0; v < M; v++) {
        double off = 0, all = 0;
        for (size_t i = v * N; i < (v + 1) * N; i++) {
            off += f.m.area[i % N] * (B[1][i] - B[0][i]) * (B[1][i] - B[0][i]);
            all += f.m.area[i % N] * B[0][i] * B[0][i];
        }
        ck_assert_double_le(sqrt(off / all), 1e-7);
    }
    for (int k = 0; k < 2; k++) free(B[k]);
    free(E);
    fixture_free(&f);
}
END_TEST

/* A few emissions do not pay an LU, hundreds do; a guide makes iterations cheaper. */
START_TEST(reference_is_chosen_by_its_cost) {
    fixture f = fixture_box(unit_cube, 12, .7f);
    const factor_product F = factor_product_of_rows(&f.F), no_rows = {.n = F.n};
    ck_assert_int_eq(reference_choose(&F, f.m.area, f.m.reflectance, 2, false), REFERENCE_ITERATED);
    ck_assert_int_eq(reference_choose(&F, f.m.area, f.m.reflectance, 200, false), REFERENCE_DENSE);
    size_t m[2] = {1, 1};
    for (int guided = 0; guided < 2; guided++)
        while (reference_choose(&F, f.m.area, f.m.reflectance, m[guided], guided) == REFERENCE_ITERATED &&
               m[guided] < 1000)
            m[guided]++;
    ck_assert_uint_lt(m[0], m[1]);
    ck_assert_int_eq(reference_choose(&no_rows, f.m.area, f.m.reflectance, 200, false), REFERENCE_ITERATED);
    fixture_free(&f);
}
END_TEST

START_TEST(exact_cube) {
    fixture f = fixture_box(unit_cube, cubes[_i].divisions, .5f);
    const size_t n = f.m.n, cells = n / 6;
    build_options options = defaults();
    options.method = "exact";
    build_report report;
    lam_operator *op = build(problem_of(&f), &options, &report);
    ck_assert_str_eq(report.method, "exact");
    float *E = calloc(n, sizeof *E), *B = calloc(n, sizeof *B);
    double *wide = calloc(n, sizeof *wide);
    for (size_t i = 0; i < cells; i++) E[i] = 1;
    apply(op, LAM_RADIOSITY, E, B);
    for (size_t i = 0; i < n; i++) wide[i] = (double)B[i];
    /* The operator and its sums over n are single precision now: 1e-6. */
    ck_assert_double_eq_tol(face_mean(wide, cubes[_i].divisions, 0), cubes[_i].emitter, 1e-6);
    ck_assert_double_eq_tol(face_mean(wide, cubes[_i].divisions, 1), cubes[_i].opposite, 1e-6);
    ck_assert_double_eq_tol(face_mean(wide, cubes[_i].divisions, 2), cubes[_i].adjacent, 1e-6);
    lam_operator_close(op);
    free(E);
    free(B);
    free(wide);
    fixture_free(&f);
}
END_TEST

/* Room 10 x 6 x 3, one element a face, rho ceiling .7, floor .2, walls .5, E_ceiling = 1. */
START_TEST(room_one_element_per_face) {
    fixture f = fixture_box(room, 1, .5f);
    /* faces: x0, x1 (6 x 3), y0, y1 (10 x 3), floor, ceiling */
    f.m.reflectance[4] = .2f;
    f.m.reflectance[5] = .7f;
    const double expected[6] = {.244787308, .244787308, .249787404, .249787404, .136329470, 1.135385436};
    float E[6] = {0, 0, 0, 0, 0, 1}, B[6], H[6];
    const char *const methods[] = {"exact", "low-rank"};
    for (int method = 0; method < 2; method++) {
        build_options options = defaults();
        options.method = methods[method];
        set_number(&options, "epsilon", 1e-6); /* full rank */
        build_report report;
        lam_operator *op = build(problem_of(&f), &options, &report);
        apply(op, LAM_RADIOSITY, E, B);
        apply(op, LAM_IRRADIANCE, E, H);
        double absorbed = 0;
        for (int i = 0; i < 6; i++) {
            ck_assert_double_eq_tol((double)B[i], expected[i], 1e-6);
            absorbed += f.m.area[i] * (1 - (double)f.m.reflectance[i]) * (double)H[i];
        }
        ck_assert_double_eq_tol(absorbed, 60, 6e-5);
        lam_operator_close(op);
    }
    fixture_free(&f);
}
END_TEST

/* A sphere as a matrix: F_ij = A_j / A (with F_ii = A_i / A), B_i = E_i + rho_i mean(E) / (1 - mean(rho)). */
START_TEST(sphere_has_rank_one) {
    enum { N = 60 };
    double area[N], total = 0, mean_E = 0, mean_rho = 0;
    float rho[N], E[N], B[N];
    uint64_t indptr[N + 1] = {0};
    uint32_t indices[N * N], order[N];
    float data[N * N];
    for (int i = 0; i < N; i++) {
        area[i] = 1 + (i * 7 % 11);
        rho[i] = .1f + .01f * (float)(i % 13);
        E[i] = (float)(i % 5);
        order[i] = (uint32_t)i;
        total += area[i];
    }
    for (int i = 0; i < N; i++) {
        mean_E += area[i] * (double)E[i] / total;
        mean_rho += area[i] * (double)rho[i] / total;
        for (int j = 0; j < N; j++) {
            indices[i * N + j] = (uint32_t)j;
            data[i * N + j] = (float)(area[j] / total);
        }
        indptr[i + 1] = (uint64_t)(i + 1) * N;
    }
    const csr F = {.n = N, .indptr = indptr, .indices = indices, .data = data};
    const build_problem problem = {
        .n = N, .n_channels = 1, .area = area, .reflectance = rho, .F = &F, .order = order};
    const char *const methods[] = {"exact", "low-rank"};
    for (int method = 0; method < 2; method++) {
        build_options options = defaults();
        options.method = methods[method];
        set_number(&options, "epsilon", 1e-3);
        build_report report;
        lam_operator *op = build(&problem, &options, &report);
        if (method == 1) ck_assert_double_eq(report_get(&report, "rank", -1), 1);
        apply(op, LAM_RADIOSITY, E, B);
        for (int i = 0; i < N; i++) /* single precision in F and in the operator */
            ck_assert_double_eq_tol((double)B[i], (double)E[i] + (double)rho[i] * mean_E / (1 - mean_rho),
                                    2e-6);
        lam_operator_close(op);
    }
}
END_TEST

/* E = 1, uniform rho, closed: B = 1 / (1 - rho) (white furnace). */
START_TEST(furnace) {
    const float rhos[] = {.5f, .9f};
    for (int r = 0; r < 2; r++) {
        fixture f = fixture_box(unit_cube, 8, rhos[r]);
        const size_t n = f.m.n;
        float *E = malloc(n * sizeof *E), *B = malloc(n * sizeof *B);
        for (size_t i = 0; i < n; i++) E[i] = 1;
        const double expected = 1 / (1 - (double)rhos[r]);
        build_options options = defaults();
        build_report report;
        options.method = "exact";
        lam_operator *op = build(problem_of(&f), &options, &report);
        apply(op, LAM_RADIOSITY, E, B);
        for (size_t i = 0; i < n; i++) ck_assert_double_eq_tol((double)B[i], expected, 1e-5 * expected);
        lam_operator_close(op);
        options.method = "low-rank";
        op = build(problem_of(&f), &options, &report);
        apply(op, LAM_RADIOSITY, E, B);
        double error = 0;
        for (size_t i = 0; i < n; i++) error += pow((double)B[i] / expected - 1, 2) / (double)n;
        /* eq. 2.9 with equal areas: relative error at most epsilon / (1 - max rho). */
        ck_assert_double_le(sqrt(error),
                            report_get(&report, "measured_norm_error", 1) / (1 - (double)rhos[r]) + 1e-5);
        ck_assert_double_eq_tol(report_get(&report, "relative_bound", -1) * (1 - (double)rhos[r]),
                                report_get(&report, "measured_norm_error", 1), 1e-12);
        lam_operator_close(op);
        free(E);
        free(B);
        fixture_free(&f);
    }
}
END_TEST

START_TEST(judge_finds_the_exact_operator_exact) {
    fixture f = fixture_box(room, 4, .5f);
    const size_t n = f.m.n;
    f.m.reflectance[3] = 0; /* a black emitter must not upset anything */
    f.m.emission[3] = 2;
    double *row_sums = calloc(n, sizeof *row_sums);
    for (size_t i = 0; i < n; i++)
        for (uint64_t p = f.F.indptr[i]; p < f.F.indptr[i + 1]; p++) row_sums[i] += (double)f.F.data[p];
    const char *const methods[] = {"exact", "low-rank"};
    for (int method = 0; method < 2; method++) {
        build_options options = defaults();
        options.method = methods[method];
        build_report built;
        lam_operator *op = build(problem_of(&f), &options, &built);
        followed seen = {.n_stages = 0};
        const progress told = {.report = followed_report, .context = &seen};
        const judge_input input = {.problem = &f.problem,
                                   .row_sums = row_sums,
                                   .emission = f.m.emission,
                                   .own = factor_product_of_rows(&f.F),
                                   .independent = factor_product_of_rows(&f.F),
                                   .other = factor_product_of_rows(&f.F),
                                   .relation = REFERENCE_TWIN,
                                   .probes = 40,
                                   .seed = 1,
                                   .progress = &told};
        error_report report;
        lam_error error = {0};
        ck_assert_msg(judge_operator(op, &input, &report, &error) == LAM_OK, "%s", error.message);
        /* The beginning, three references, the end. */
        ck_assert_uint_eq(seen.n_stages, 1);
        ck_assert_uint_ge(seen.n_reports, 5);
        ck_assert(seen.share == 1);
        ck_assert_uint_eq(report.single.probes, 40);
        ck_assert_uint_eq(report.lights.probes, 1);
        const error_group *groups[3] = {&report.single, &report.lights, &report.random};
        for (int g = 0; g < 3; g++) {
            ck_assert(groups[g]->probes > 0);
            /* The same F on both sides: total and operator figures agree, the samples do not differ. */
            ck_assert_double_eq_tol(groups[g]->total_indirect.mean, groups[g]->operator_indirect.mean, 1e-12);
            ck_assert_double_eq_tol(groups[g]->reference_noise, 0, 1e-12);
            ck_assert(groups[g]->operator_indirect.max >= groups[g]->operator_indirect.mean);
            if (method == 0) {
                ck_assert_double_le(groups[g]->operator_relative.max, 1e-6);
                /* Exact's P_ii is stored as M_ii, whose rounding of 6e-8 is 1e-5 of the indirect light here.
                 */
                ck_assert_double_le(groups[g]->operator_indirect.max, 1e-5);
                ck_assert_double_le(groups[g]->energy_balance, 1e-5);
            } else {
                ck_assert_double_ge(groups[g]->operator_indirect.mean, 1e-5);
                ck_assert_double_le(groups[g]->operator_relative.max,
                                    report_get(&built, "measured_norm_error", 1) / .5);
            }
        }
        lam_operator_close(op);
    }
    free(row_sums);
    fixture_free(&f);
}
END_TEST

/* Half of the elements see one another in pairs, the others nothing: too many elements for a dense reference,
 * whose zeros would be exact, and an operator that is a little wrong everywhere. */
START_TEST(judge_ignores_what_sees_nothing) {
    enum { N = REFERENCE_DENSE_ELEMENTS + 2 };
    lam_error error = {0};
    csr F = {.n = N,
             .indptr = calloc(N + 1, sizeof(uint64_t)),
             .indices = calloc(N, sizeof(uint32_t)),
             .data = calloc(N, sizeof(float))};
    double *area = calloc(N, sizeof *area), *row_sums = calloc(N, sizeof *row_sums);
    float *rho = calloc(N, sizeof *rho), *emission = calloc(N, sizeof *emission);
    float *Y = calloc(N, sizeof *Y), *V = calloc(N, sizeof *V);
    for (size_t i = 0; i < N; i++) {
        F.indptr[i + 1] = F.indptr[i];
        area[i] = 1;
        rho[i] = .5f;
        Y[i] = -1e-4f;
        V[i] = 1e-4f;
        if (i % 4 >= 2) continue;
        F.indices[F.indptr[i]] = (uint32_t)(i ^ 1);
        F.data[F.indptr[i + 1]++] = .5f;
        row_sums[i] = .5;
    }
    lam_operator *op = NULL;
    ck_assert_msg(operator_low_rank_create_folded(N, 1, rho, Y, V, &op, &error) == LAM_OK, "%s",
                  error.message);
    const build_problem problem = {
        .n = N, .n_channels = 1, .area = area, .reflectance = rho, .F = &F, .order = NULL};
    const judge_input input = {.problem = &problem,
                               .row_sums = row_sums,
                               .emission = emission,
                               .own = factor_product_of_rows(&F),
                               .independent = factor_product_of_rows(&F),
                               .other = factor_product_of_rows(&F),
                               .relation = REFERENCE_TWIN,
                               .probes = 40,
                               .seed = 1};
    error_report report;
    ck_assert_msg(judge_operator(op, &input, &report, &error) == LAM_OK, "%s", error.message);
    /* With E_i = 1 its partner gives back B_j = rho F = .25 and the operator next to nothing: wrong by all of
     * it. */
    ck_assert_double_eq_tol(report.single.operator_indirect.max, 1, 1e-2);
    ck_assert_double_eq_tol(report.single.reference_noise, 0, 1e-9);
    lam_operator_close(op);
    csr_free(&F);
    free(area);
    free(row_sums);
    free(rho);
    free(emission);
}
END_TEST

START_TEST(auto_explains_itself) {
    fixture f = fixture_box(unit_cube, 3, .5f);
    build_options options = defaults();
    options.method = "auto";
    build_report report;
    lam_operator *op = build(problem_of(&f), &options, &report);
    ck_assert_str_eq(report.method, "exact");
    ck_assert_ptr_nonnull(strstr(report.reason, "54 elements"));
    lam_operator_close(op);
    fixture_free(&f);
}
END_TEST

START_TEST(bad_options_are_refused) {
    fixture f = fixture_box(unit_cube, 2, .5f);
    lam_operator *op = NULL;
    build_report report;
    lam_error error = {0};
    build_options options = defaults();
    options.method = "emitters"; /* and none are asked for */
    ck_assert_int_eq(build_operator(problem_of(&f), &options, &op, &report, &error), LAM_ERR_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(error.message, "--emitters"));
    options.method = "magic";
    ck_assert_int_eq(build_operator(&f.problem, &options, &op, &report, &error), LAM_ERR_ARGUMENT);
    options = defaults();
    options.epsilon = NAN;
    ck_assert_int_eq(build_operator(&f.problem, &options, &op, &report, &error), LAM_ERR_ARGUMENT);
    options = defaults();
    ((low_rank_options *)own_options(&options, "low-rank"))->epsilon = NAN;
    ck_assert_int_eq(build_operator(&f.problem, &options, &op, &report, &error), LAM_ERR_ARGUMENT);
    options = defaults();
    options.method = "exact";
    options.memory = 100;
    ck_assert_int_eq(build_operator(&f.problem, &options, &op, &report, &error), LAM_ERR_MEMORY);
    ck_assert_ptr_nonnull(strstr(error.message, "--method low-rank"));
    ck_assert_ptr_null(op);
    fixture_free(&f);
}
END_TEST

/* Black elements, among them a whole wall, and nearly black and bright ones: all columns of the operator
 * against sums of bounces in double. The second case has form factors that lack reciprocity. */
START_TEST(exact_with_black_elements) {
    enum { DIVISIONS = 4, N = 6 * DIVISIONS * DIVISIONS, BOUNCES = 400 };
    fixture f = fixture_box(room, DIVISIONS, .5f);
    const csr *F = &f.F;
    build_options options = defaults();
    build_report report;
    options.method = "exact";
    for (size_t i = 0; i < N; i++) {
        static const float rho[4] = {0, .2f, .9f, 1e-6f};
        f.m.reflectance[i] = i < N / 6 ? 0 : rho[i * 7 % 4];
    }
    if (_i == 1)
        for (uint64_t p = F->indptr[20]; p < F->indptr[21]; p++) F->data[p] *= .9f;
    lam_operator *op = build(problem_of(&f), &options, &report);
    float *E = calloc(N, sizeof *E), *H = calloc(N, sizeof *H);
    double *B = calloc(N, sizeof *B), *next = calloc(N, sizeof *next);
    for (size_t j = 0; j < N; j++) {
        double most = 0;
        for (size_t i = 0; i < N; i++) E[i] = i == j, B[i] = i == j;
        for (size_t bounce = 0; bounce < BOUNCES; bounce++) {
            csr_multiply_rows(F, 0, N, 1, B, next);
            for (size_t i = 0; i < N; i++) B[i] = (i == j) + (double)f.m.reflectance[i] * next[i];
        }
        csr_multiply_rows(F, 0, N, 1, B, next);
        apply(op, LAM_IRRADIANCE, E, H);
        for (size_t i = 0; i < N; i++) most = fmax(most, next[i]);
        for (size_t i = 0; i < N; i++) {
            const double rho = (double)f.m.reflectance[i], rounding = i == j && rho > 0 ? 6e-8 / rho : 0;
            ck_assert_double_le(fabs((double)H[i] - next[i]), 2e-6 * most + rounding); /* of 1 + P_ii */
        }
    }
    lam_operator_close(op);
    free(E);
    free(H);
    free(B);
    free(next);
    fixture_free(&f);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("build");
    TCase *cases = tcase_create("build");
    tcase_set_timeout(cases, 300);
    tcase_add_loop_test(cases, reference_cube, 0, 3);
    tcase_add_test(cases, both_ways_of_a_reference_agree);
    tcase_add_test(cases, reference_is_chosen_by_its_cost);
    tcase_add_loop_test(cases, exact_cube, 0, 3);
    tcase_add_loop_test(cases, exact_with_black_elements, 0, 2);
    tcase_add_test(cases, room_one_element_per_face);
    tcase_add_test(cases, sphere_has_rank_one);
    tcase_add_test(cases, furnace);
    tcase_add_test(cases, judge_finds_the_exact_operator_exact);
    tcase_add_test(cases, judge_ignores_what_sees_nothing);
    tcase_add_test(cases, auto_explains_itself);
    tcase_add_test(cases, bad_options_are_refused);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
