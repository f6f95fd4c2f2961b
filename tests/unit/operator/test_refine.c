/* Refined answers of scenes and of problems that are hard on numbers, against a dense LU; form factors of
 * both storages. */
#include "solver/base/random.h"
#include "solver/operator/refine/refinement.h"
#include "support/building.h"
#include "support/certified.h"
#include "support/dense.h"
#include "support/scene.h"
#include "support/suite.h"
#include "support/view.h"
#include "tests/bench/suites/scenes.h"
#include "tests/bench/suites/stability.h"

#include <omp.h>

static lam_error error;

static lam_operator *build(build_problem *problem, const char *method, double epsilon) {
    build_options options = options_with(method, epsilon);
    set_number(&options, "threshold", .01);
    build_report report;
    lam_operator *op = NULL;
    ck_ok(build_operator(problem, &options, &op, &report, &error));
    return op;
}

/* f and reflectance [C][n] stay the caller's. */
static certified subject(const char *name, const char *method, double epsilon, size_t n_channels,
                         const csr *f, const double *area, const float *reflectance, const uint32_t *order) {
    const size_t n = f->n, nnz = f->indptr[n];
    csr copy = {.n = n,
                .indptr = test_allocate(n + 1, sizeof *copy.indptr),
                .indices = test_allocate(nnz, sizeof *copy.indices),
                .data = test_allocate(nnz, sizeof *copy.data)};
    memcpy(copy.indptr, f->indptr, (n + 1) * sizeof *copy.indptr);
    memcpy(copy.indices, f->indices, nnz * sizeof *copy.indices);
    memcpy(copy.data, f->data, nnz * sizeof *copy.data);
    build_problem problem = {
        .n = n, .n_channels = n_channels, .area = area, .reflectance = reflectance, .F = f, .order = order};
    lam_operator *op = build(&problem, method, epsilon);
    lam_form_factors *F = NULL;
    ck_ok(form_factors_of_rows(&copy, area, &F, &error));
    return certified_make(name, op, F);
}

/* One bright element, a lamp in dim light, random emission; H0 of a sky that some elements see. */
static void light(const certified *s, size_t n_rhs, double *E, double *H0) {
    const size_t n = s->op->n;
    uint64_t seed = 12;
    for (size_t row = 0; row < n_rhs * s->op->n_channels; row++)
        for (size_t i = 0; i < n; i++) {
            const double x = random_lcg_unit(&seed), y = random_lcg_unit(&seed);
            E[row * n + i] = row % 3 == 0                  ? (i == n / 2 ? 2.0 : 0.0)
                             : row % 3 == 1 && i % 50 == 7 ? 1e5 * x
                                                           : x;
            H0[row * n + i] = y < .5 ? 0 : 10 * y;
        }
}

enum { BATCH = 3 };

static void check_all(const certified *s) {
    static const double tolerances[] = {.1, 1e-4, 1e-6, 1e-9};
    const size_t count = BATCH * s->op->n_channels * s->op->n;
    double *E = test_allocate(count, sizeof *E), *H0 = test_allocate(count, sizeof *H0);
    light(s, BATCH, E, H0);
    for (size_t k = 0; k < sizeof tolerances / sizeof *tolerances; k++)
        for (lam_quantity q = LAM_RADIOSITY; q <= LAM_INDIRECT; q++)
            for (int lit = 0; lit < 2; lit++)
                certified_check(s, BATCH, q, E, lit ? H0 : NULL, NULL, tolerances[k]);
    free(E);
    free(H0);
}

static const double reflectances[] = {.5, .99, .9999};

START_TEST(hard_problems) {
    static const struct {
        const char *method;
        double epsilon;
    } ways[] = {{"exact", .05}, {"low-rank", .3}, {"sparse", .05}};
    stability_problem p;
    ck_ok(stability_make(_i % STABILITY_PROBLEMS, reflectances[_i / STABILITY_PROBLEMS], &p, &error));
    for (size_t k = 0; k < sizeof ways / sizeof *ways; k++) {
        /* A sparse inverse of a furnace is all of its bounces. */
        if (k == 2 && _i >= STABILITY_PROBLEMS) continue;
        certified s =
            subject(p.name, ways[k].method, ways[k].epsilon, 1, &p.F, p.area, p.reflectance, p.order);
        check_all(&s);
        certified_free(&s);
    }
    stability_free(&p);
}
END_TEST

START_TEST(scenes) {
    view v = make_view(_i);
    if (_i == CORNELL) ck_assert_uint_eq(v.m.n_channels, 3);
    certified s = subject(v.name, "low-rank", .1, v.m.n_channels, &v.f.F, v.m.area, v.m.reflectance, v.order);
    check_all(&s);
    certified_free(&s);
    view_free(&v);
}
END_TEST

/* Where one element reflects nearly all and the others half, the certificate is that of the room, not that of
 * the element: |r|/(1 - rho s) would be a thousand times the error. */
START_TEST(one_bright_wall_is_not_all_walls) {
    stability_problem p;
    ck_ok(stability_make(STABILITY_ROOM, .5, &p, &error));
    p.reflectance[7] = .9999f;
    certified s = subject("one wall", "low-rank", .3, 1, &p.F, p.area, p.reflectance, p.order);
    /* A^-1 1 is 2 where all walls reflect half, there it is 1 + .9999 2. */
    ck_assert_double_lt(s.refiner->channels[0].w_most, 3 * 1.05);
    check_all(&s);
    certified_free(&s);
    stability_free(&p);
}
END_TEST

/* Where a bound asks for less than averaging alone says, rows are multiplied for it, and A^-1 R F r stays
 * within it; where it does not, or they would be too many, it is the averaging's. */
START_TEST(rows_in_the_way_are_multiplied) {
    view v = make_view(CORNELL);
    certified s = subject(v.name, "low-rank", .1, v.m.n_channels, &v.f.F, v.m.area, v.m.reflectance, v.order);
    const size_t n = s.op->n;
    const csr *F = &s.F->F;
    double *r = test_allocate(n, sizeof *r), *b = test_allocate(n, sizeof *b),
           *lacks = test_allocate(n, sizeof *lacks);
    uint64_t seed = 5;
    size_t sharper = 0;
    for (size_t k = 0; k < 8; k++)
        for (size_t c = 0; c < s.op->n_channels; c++) {
            const refine_channel *channel = &s.refiner->channels[c];
            double true_most = 0;
            for (size_t i = 0; i < n; i++) {
                r[i] = k == 0 ? (i == n / 3 ? -1 : 0) : random_lcg_unit(&seed) - .5;
            }
            for (size_t i = 0; i < n; i++) {
                double sum = 0;
                for (uint64_t p = F->indptr[i]; p < F->indptr[i + 1]; p++)
                    sum += (double)F->data[p] * r[F->indices[p]];
                b[i] = (double)channel->rho[i] * sum;
                lacks[i] = 0;
            }
            ck_ok(reference_solve(s.truth[c], 1, b, lacks, 1e-12, NULL, &error));
            for (size_t i = 0; i < n; i++) true_most = fmax(true_most, fabs(lacks[i]));
            const double plain = refine_left(s.refiner, channel, r, refine_most(n, r), INFINITY);
            ck_assert_double_le(true_most, plain * (1 + 1e-9));
            for (double share = .9; share > .05; share -= .1) {
                const double left = refine_left(s.refiner, channel, r, refine_most(n, r), share * plain);
                ck_assert_double_le(true_most, left * (1 + 1e-9));
                ck_assert_double_le(left, plain);
                sharper += left <= share * plain;
            }
            ck_assert(refine_left(s.refiner, channel, r, refine_most(n, r), 0) == plain);
        }
    ck_assert_uint_gt(sharper, 0);
    free(r);
    free(b);
    free(lacks);
    certified_free(&s);
    view_free(&v);
}
END_TEST

/* Iterations to 1e-6, of random emission. */
static size_t iterations_of(const certified *s) {
    const size_t n = s->op->n;
    double *E = test_allocate(n, sizeof *E), *out = test_allocate(n, sizeof *out), certificate;
    size_t iterations = 0;
    for (size_t i = 0; i < n; i++) E[i] = (double)(i % 7);
    ck_ok(lam_refine(s->refiner, 1, LAM_RADIOSITY, E, NULL, NULL, 1e-6, out, &certificate, &iterations,
                     &error));
    free(E);
    free(out);
    return iterations;
}

/* An operator in bytes helps where its own error is far more than what bytes round. */
START_TEST(bytes_help_what_is_coarse) {
    static const struct {
        const char *method;
        double epsilon;
        bool helps;
    } cases[] = {
        {"low-rank", .2, true}, {"low-rank", .3, true}, {"low-rank", 1e-4, false}, {"exact", .2, false}};
    stability_problem p;
    ck_ok(stability_make(STABILITY_ROOM, .6, &p, &error));
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        certified s = subject(cases[k].method, cases[k].method, cases[k].epsilon, 1, &p.F, p.area,
                              p.reflectance, p.order);
        ck_assert_msg((s.refiner->helper != NULL) == cases[k].helps, "%s, epsilon %g", cases[k].method,
                      cases[k].epsilon);
        const size_t with = iterations_of(&s);
        lam_operator_close(s.refiner->helper);
        s.refiner->helper = NULL;
        ck_assert_uint_le(with, iterations_of(&s) + 1);
        certified_free(&s);
    }
    stability_free(&p);
}
END_TEST

/* The bound is of the very F: where rows sum to more than rho allows nothing can be certified. */
START_TEST(what_gains_light_is_refused) {
    uint64_t indptr[] = {0, 1, 2};
    uint32_t indices[] = {1, 0};
    float data[] = {1.00001f, 1.00001f}, rho[] = {.999999f, .999999f};
    const double area[] = {1, 1};
    csr F = {
        .n = 2, .indptr = test_allocate(3, 8), .indices = test_allocate(2, 4), .data = test_allocate(2, 4)};
    memcpy(F.indptr, indptr, sizeof indptr);
    memcpy(F.indices, indices, sizeof indices);
    memcpy(F.data, data, sizeof data);
    float *P = test_allocate(4, sizeof *P);
    lam_operator *op = NULL;
    lam_form_factors *made = NULL;
    lam_refiner *refiner = NULL;
    ck_ok(operator_exact_create(2, 1, rho, P, &op, &error));
    ck_ok(form_factors_of_rows(&F, area, &made, &error));
    ck_assert(lam_refiner_create(op, made, &refiner, &error) == LAM_ERR_NUMERIC);
    ck_assert_msg(
        strstr(error.message,
               "element 0 of channel 0: reflectance times the sum of its form factors is 1.00000") != NULL,
        "%s", error.message);
    ck_assert_ptr_null(refiner);
    lam_form_factors_close(made);
    lam_operator_close(op);
}
END_TEST

/* An operator of few emitters is no help, but its own light is a start, which single precision makes good. */
START_TEST(emitters_start_from_their_light) {
    enum { S = 2 };
    stability_problem p;
    ck_ok(stability_make(STABILITY_ROOM, .8, &p, &error));
    const size_t n = p.n;
    float *E = test_allocate(S * n, sizeof *E), *from = test_allocate(S * n, sizeof *from);
    double *wide = test_allocate(S * n, sizeof *wide);
    E[3] = 2;
    for (size_t i = 0; i < n; i++) E[n + i] = i % 4 == 0 ? 1 : 0;
    for (size_t k = 0; k < S * n; k++) wide[k] = (double)E[k];
    const emitter_source source = {.s = S, .names = (const char *[]){"a", "b"}, .E = E};
    build_problem problem = {.n = n,
                             .n_channels = 1,
                             .area = p.area,
                             .reflectance = p.reflectance,
                             .F = &p.F,
                             .order = p.order,
                             .emitters = &source};
    lam_operator *op = build(&problem, "emitters", .05);
    csr F = p.F;
    p.F = (csr){.n = 0};
    lam_form_factors *made = NULL;
    ck_ok(form_factors_of_rows(&F, p.area, &made, &error));
    certified s = certified_make("emitters", op, made);
    const float W[S * S] = {1, 0, 0, 1};
    const size_t work_bytes = lam_operator_work_bytes(op, S);
    void *work = malloc(work_bytes);
    ck_ok(lam_operator_apply_emitters(op, S, LAM_INDIRECT, W, n, NULL, from, work, work_bytes, &error));
    double certificates[2][S], *out = test_allocate(S * n, sizeof *out);
    size_t iterations[2][S];
    for (int started = 0; started < 2; started++) {
        certified_check(&s, S, LAM_RADIOSITY, wide, NULL, started ? from : NULL, 1e-9);
        ck_ok(lam_refine(s.refiner, S, LAM_RADIOSITY, wide, NULL, started ? from : NULL, 1e-9, out,
                         certificates[started], iterations[started], &error));
    }
    for (size_t k = 0; k < S; k++) ck_assert_uint_lt(iterations[1][k], iterations[0][k]);
    /* Nonsense is a start as well. */
    for (size_t k = 0; k < S * n; k++) from[k] = k % 3 == 0 ? NAN : k % 3 == 1 ? -1e30f : INFINITY;
    certified_check(&s, S, LAM_RADIOSITY, wide, NULL, from, 1e-9);
    free(E);
    free(from);
    free(wide);
    free(work);
    free(out);
    certified_free(&s);
    stability_free(&p);
}
END_TEST

static void write_store(const char *path, const mesh *m, const form_factors *f) {
    store *s = NULL;
    ck_ok(store_create(path, &s, &error));
    ck_ok(store_set_text(s, "/", "name", "a", &error));
    ck_ok(mesh_save(m, f->row_sums, s, &error));
    if (f->F.indptr != NULL || f->upper.indptr != NULL) ck_ok(form_factors_save(f, s, &error));
    ck_ok(store_seal(s, &error));
}

/* Rows and the triangle give the same F, to the bit; a store without F gives NULL. */
START_TEST(both_storages) {
    char folder[64], path[128];
    view v = make_view(CITY);
    const size_t n = v.m.n;
    lam_form_factors *rows = NULL, *upper = NULL, *none = (void *)&error;
    folder_make(folder);
    snprintf(path, sizeof path, "%s/a.h5", folder);
    ck_ok(form_factors_gather(&v.f, v.m.area, &error));
    ck_assert_ptr_nonnull(v.f.upper.indptr);
    write_store(path, &v.m, &v.f);
    ck_ok(lam_form_factors_open(path, &upper, &error));
    ck_ok(form_factors_expand(&v.f, v.m.area, &error));
    write_store(path, &v.m, &v.f);
    ck_ok(lam_form_factors_open(path, &rows, &error));
    const size_t nnz = rows->F.indptr[n];
    ck_assert_uint_eq(lam_form_factors_bytes(rows), 8 * nnz + 8 * (n + 1));
    ck_assert_mem_eq(rows->F.indptr, upper->F.indptr, (n + 1) * sizeof *rows->F.indptr);
    ck_assert_mem_eq(rows->F.indices, upper->F.indices, nnz * sizeof *rows->F.indices);
    ck_assert_mem_eq(rows->F.data, upper->F.data, nnz * sizeof *rows->F.data);
    ck_assert_mem_eq(rows->F.data, v.f.F.data, nnz * sizeof *rows->F.data);
    ck_assert_uint_eq(rows->longest, upper->longest);
    for (size_t i = 0; i < n; i++) ck_assert(fabs(rows->row_sums[i] - upper->row_sums[i]) < 1e-12);
    csr_free(&v.f.F);
    write_store(path, &v.m, &v.f);
    ck_ok(lam_form_factors_open(path, &none, &error));
    ck_assert_ptr_null(none);
    ck_assert(lam_form_factors_open("/nowhere/a.h5", &none, &error) == LAM_ERR_IO);
    ck_assert(lam_form_factors_open(NULL, &none, &error) == LAM_ERR_ARGUMENT);
    lam_form_factors_close(rows);
    lam_form_factors_close(upper);
    folder_remove(folder);
    view_free(&v);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("refine");
    TCase *tests = tcase_create("refine");
    tcase_set_timeout(tests, 600);
    /* libcheck forks, and threads of OpenMP do not survive that. */
    omp_set_num_threads(1);
    tcase_add_loop_test(tests, hard_problems, 0, 3 * STABILITY_PROBLEMS);
    tcase_add_loop_test(tests, scenes, 0, SCENES);
    tcase_add_test(tests, one_bright_wall_is_not_all_walls);
    tcase_add_test(tests, rows_in_the_way_are_multiplied);
    tcase_add_test(tests, bytes_help_what_is_coarse);
    tcase_add_test(tests, what_gains_light_is_refused);
    tcase_add_test(tests, emitters_start_from_their_light);
    tcase_add_test(tests, both_storages);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
