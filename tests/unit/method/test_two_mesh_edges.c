/* 2MSC where there is next to nothing to it, and what it refuses. */
#include "support/room.h"
#include "support/suite.h"
#include "support/two_mesh.h"

#include <omp.h>

static lam_error error;

START_TEST(nothing_seen_is_direct_light) {
    static const char *const factorizers[] = {"auto", "qr"};
    room r = room_create(hall, 3, .5f, 1);
    memset(r.F.indptr, 0, (r.m.n + 1) * sizeof *r.F.indptr);
    for (int f = 0; f < 2; f++)
        for (size_t rank = 0; rank <= 54; rank += 27) {
            build_report report;
            lam_operator *op = build_rank(&r, rank, factorizers[f], &report);
            float *E = random_vectors(r.m.n, 3), *B = transport_apply(op, false, 1, LAM_RADIOSITY, E);
            ck_assert_mem_eq(B, E, r.m.n * sizeof *B);
            ck_assert_double_eq(report_get(&report, "measured_norm_error", -1), 0);
            ck_assert_double_eq(report_get(&report, "coherence_min", -1), 1);
            free(E);
            free(B);
            lam_operator_close(op);
        }
    room_free(&r);
}
END_TEST

START_TEST(without_reflectance_light_arrives_once) {
    room r = room_create(hall, 3, 0, 1);
    build_report report;
    lam_operator *op = build_rank(&r, 9, "auto", &report);
    float *E = test_allocate(r.m.n, sizeof *E);
    for (size_t i = 0; i < r.m.n; i++) E[i] = 1;
    float *B = transport_apply(op, false, 1, LAM_RADIOSITY, E);
    float *H = transport_apply(op, false, 1, LAM_IRRADIANCE, E);
    for (size_t i = 0; i < r.m.n; i++) {
        ck_assert_float_eq(B[i], 1);
        ck_assert_double_eq_tol((double)H[i], 1, 1e-7 + tolerance(9, 0));
    }
    ck_assert_double_eq(report_get(&report, "rcond", -1), 1);
    free(E);
    free(B);
    free(H);
    lam_operator_close(op);
    room_free(&r);
}
END_TEST

START_TEST(one_element) {
    mesh m = {0};
    const double corners[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    mesh_add_quad(&m, corners);
    mesh_finish(&m, .5f);
    uint64_t indptr[2] = {0, 0};
    const csr F = {.n = 1, .indptr = indptr};
    const uint32_t order[1] = {0};
    build_problem problem = {
        .n = 1, .n_channels = 1, .area = m.area, .reflectance = m.reflectance, .F = &F, .order = order};
    const double centre[1][3] = {{.5, .5, 0}};
    const uint32_t surface[1] = {0};
    problem.centre = centre;
    problem.normal = (const float(*)[3])m.normal;
    problem.surface = surface;
    for (int f = 0; f < 2; f++) {
        build_options options = build_presets("2msc");
        build_report report;
        set_text(&options, "factorizer", f == 0 ? "auto" : "qr");
        set_text(&options, "assign", "proximity");
        lam_operator *op = build_as(&problem, &options, &report);
        const float E = 3;
        float *B = transport_apply(op, false, 1, LAM_RADIOSITY, &E);
        ck_assert_float_eq(B[0], 3);
        ck_assert_double_eq(report_get(&report, "rank", -1), 1);
        free(B);
        lam_operator_close(op);
    }
    mesh_free(&m);
}
END_TEST

static void check_refused(const build_problem *problem, const build_options *options, lam_status expected,
                          const char *word) {
    lam_operator *op = NULL;
    build_report report;
    error = (lam_error){.message = ""};
    ck_assert_int_eq(build_operator(problem, options, &op, &report, &error), expected);
    ck_assert_msg(strstr(error.message, word) != NULL, "no '%s' in: %s", word, error.message);
    ck_assert_ptr_null(op);
}

/* Two elements that each send all they have to the other, twice: at rho = .5 nothing is ever lost. */
START_TEST(a_core_that_is_singular_is_refused) {
    room r = room_create(cube, 1, .5f, 1);
    build_options options = build_presets("2msc");
    set_number(&options, "rank", 6);
    memset(r.F.indptr, 0, 7 * sizeof *r.F.indptr);
    for (size_t i = 0; i < 2; i++) {
        r.F.indices[i] = (uint32_t)(1 - i);
        r.F.data[i] = 2;
    }
    for (size_t i = 1; i < 7; i++) r.F.indptr[i] = i < 2 ? 1 : 2;
    check_refused(room_problem(&r), &options, LAM_ERR_NUMERIC, "lower the largest reflectance");
    room_free(&r);
}
END_TEST

/* The factorizers of low rank have no use here: the operator is the same without them. */
START_TEST(other_factorizers_are_not_used) {
    static const char *const others[] = {"hf", "svd", "rsi", "sgrsvd"};
    room r = room_create(cube, 4, .5f, 1);
    float *E = random_vectors(r.m.n, 5);
    build_report report;
    lam_operator *op = build_rank(&r, 12, "auto", &report);
    float *expected = transport_apply(op, false, 1, LAM_RADIOSITY, E);
    lam_operator_close(op);
    for (int f = 0; f < 4; f++) {
        op = build_rank(&r, 12, others[f], &report);
        float *B = transport_apply(op, false, 1, LAM_RADIOSITY, E);
        ck_assert(report_is(&report, "factorizer", "none"));
        ck_assert_mem_eq(B, expected, r.m.n * sizeof *B);
        free(B);
        lam_operator_close(op);
    }
    build_options options = build_presets("2msc"); /* exact uses none of them, nor qr */
    options.method = "exact";
    set_text(&options, "factorizer", "qr");
    lam_operator_close(build_as(room_problem(&r), &options, &report));
    ck_assert(report_is(&report, "factorizer", "none"));
    free(expected);
    free(E);
    room_free(&r);
}
END_TEST

START_TEST(what_cannot_be_built_is_refused) {
    room r = room_create(cube, 4, .5f, 1);
    const build_problem *problem = room_problem(&r);
    build_options options = build_presets("2msc");
    options.memory = 1000;
    check_refused(problem, &options, LAM_ERR_MEMORY, "--rank");
    options = build_presets("2msc");
    two_mesh_options *own = own_options(&options, "2msc");
    own->coherence = 1.5;
    check_refused(problem, &options, LAM_ERR_ARGUMENT, "--coherence 1.5");
    own->coherence = NAN;
    check_refused(problem, &options, LAM_ERR_ARGUMENT, "--coherence");
    options = build_presets("2msc");
    own->min_area = -1;
    check_refused(problem, &options, LAM_ERR_ARGUMENT, "--min-area -1");
    options = build_presets("2msc");
    ck_assert_int_eq(build_set(&options, "factorizer", "cholesky", &error), LAM_ERR_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(error.message, "--factorizer cholesky"));
    static const char *const factorizing[] = {"low-rank", "auto"};
    for (int m = 0; m < 2; m++) {
        options.method = factorizing[m];
        set_text(&options, "factorizer", "qr");
        check_refused(problem, &options, LAM_ERR_ARGUMENT, "--factorizer qr");
    }
    options = build_presets("2msc");
    r.problem.surface = NULL;
    check_refused(problem, &options, LAM_ERR_INTERNAL, "surfaces");
    room_free(&r);
}
END_TEST

START_TEST(threads_give_the_same_bits) {
    room r = room_create(hall, 6, .5f, 3);
    const size_t count = 3 * r.m.n;
    const int usual = omp_get_max_threads();
    float *E = random_vectors(count, 8), *B[2];
    for (int i = 0; i < 2; i++) {
        build_report report;
        omp_set_num_threads(i == 0 ? 1 : 4);
        lam_operator *op = build_rank(&r, 40, "auto", &report);
        B[i] = transport_apply(op, false, 1, LAM_RADIOSITY, E);
        lam_operator_close(op);
    }
    omp_set_num_threads(usual);
    ck_assert_mem_eq(B[0], B[1], count * sizeof *E);
    free(E);
    free(B[0]);
    free(B[1]);
    room_free(&r);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("two meshes, edges");
    TCase *tests = tcase_create("two meshes, edges");
    tcase_set_timeout(tests, 300);
    tcase_add_test(tests, nothing_seen_is_direct_light);
    tcase_add_test(tests, without_reflectance_light_arrives_once);
    tcase_add_test(tests, one_element);
    tcase_add_test(tests, a_core_that_is_singular_is_refused);
    tcase_add_test(tests, other_factorizers_are_not_used);
    tcase_add_test(tests, what_cannot_be_built_is_refused);
    tcase_add_test(tests, threads_give_the_same_bits);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
