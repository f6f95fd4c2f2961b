/* Form factors compressed: products and their bounds beside all of F, refined answers beside a dense LU,
 * stores. */
#include "solver/base/random.h"
#include "solver/method/hierarchical/compress.h"
#include "solver/method/method.h"
#include "solver/operator/refine/form_factor_rows.h"
#include "solver/operator/refine/refinement.h"
#include "store/store.h"
#include "support/building.h"
#include "support/certified.h"
#include "support/scene.h"
#include "support/suite.h"
#include "support/view.h"

static lam_error error;

static compressed_factors compress(const view *v, double threshold, size_t n_threads) {
    compressed_factors c = {.n = 0};
    double(*centre)[3] = test_allocate(v->m.n, sizeof *centre);
    bool *shines = test_allocate(v->m.n_groups, sizeof *shines);
    for (size_t i = 0; i < v->m.n; i++) {
        mesh_centroid(&v->m, i, centre[i]);
        if (v->m.emission[i] > 0) shines[v->m.group[i]] = true;
    }
    const compress_input input = {.F = &v->f.F,
                                  .area = v->m.area,
                                  .centre = (const double(*)[3])centre,
                                  .normal = (const float(*)[3])v->m.normal,
                                  .group = v->m.group,
                                  .n_groups = v->m.n_groups,
                                  .shines = shines,
                                  .threshold = threshold,
                                  .n_threads = n_threads};
    ck_ok(compress_form_factors(&input, &c, &error));
    free(centre);
    free(shines);
    return c;
}

static compressed_factors finished(const view *v, double threshold) {
    compressed_factors c = compress(v, threshold, 2);
    ck_ok(compressed_finish(&c, &error));
    return c;
}

/* One element, what shines, all alike, anything, a slope; two of both signs. */
enum { LIGHTS = 6 };

static void light(const view *v, int which, double *x) {
    uint64_t seed = 5;
    for (size_t i = 0; i < v->m.n; i++) {
        const double any = random_lcg_unit(&seed);
        double middle[3];
        mesh_centroid(&v->m, i, middle);
        x[i] = which == 0   ? (i == v->m.n / 3)
               : which == 1 ? v->m.group[i] == v->m.group[v->m.two_sided ? 0 : v->m.n / 2]
               : which == 2 ? 1
               : which == 3 ? any
               : which == 4 ? any - .5
                            : middle[0] + 2 * middle[1] - middle[2];
    }
}

START_TEST(doubles_are_the_same_basis) {
    view v = make_view(_i);
    compressed_factors c = finished(&v, 1e-3);
    const size_t n = v.m.n;
    double *x = test_allocate(n, sizeof *x), *there = test_allocate(n, sizeof *x),
           *back = test_allocate(n, sizeof *x), before = 0, after = 0;
    double *work = test_allocate(wavelets_work(&c.basis), sizeof *work);
    light(&v, 4, x);
    wavelets_forward(&c.basis, x, there, work);
    wavelets_inverse(&c.basis, there, back, work);
    for (size_t i = 0; i < n; i++) {
        ck_assert_double_eq_tol(back[i], x[i], 1e-5);
        before += x[i] * x[i];
        after += there[i] * there[i];
    }
    ck_assert_double_eq_tol(after, before, 1e-5 * before);
    free(x);
    free(there);
    free(back);
    free(work);
    compressed_free(&c);
    view_free(&v);
}
END_TEST

/* The error of a product is never more than what is said of it, and what is said falls with the threshold. */
START_TEST(bounds_hold) {
    static const double thresholds[] = {.02, 1e-3, 3e-5, 0};
    view v = make_view(_i);
    const size_t n = v.m.n;
    double *x = test_allocate(n, sizeof *x), *y = test_allocate(n, sizeof *y),
           *bound = test_allocate(n, sizeof *bound), *exact = test_allocate(n, sizeof *exact);
    double last[LIGHTS];
    size_t kept = 0;
    for (size_t k = 0; k < sizeof thresholds / sizeof *thresholds; k++) {
        compressed_factors c = finished(&v, thresholds[k]);
        double *work = test_allocate(compressed_work(&c), sizeof *work);
        for (int which = 0; which < LIGHTS; which++) {
            double largest = 0, most = 0;
            light(&v, which, x);
            csr_multiply_rows(&v.f.F, 0, n, 1, x, exact);
            compressed_multiply(&c, x, y, work, 2);
            const double said = compressed_error(&c, x, bound, work);
            for (size_t i = 0; i < n; i++) {
                const double slack = c.rounding * refine_most(n, x);
                ck_assert_msg(fabs(y[i] - exact[i]) <= bound[i] + slack,
                              "%s, threshold %g, light %d, element %zu: %g, bound %g", v.name, thresholds[k],
                              which, i, fabs(y[i] - exact[i]), bound[i]);
                largest = fmax(largest, bound[i]);
                most = fmax(most, fabs(exact[i]));
            }
            ck_assert_double_eq(said, largest);
            if (k > 0) ck_assert_double_le(said, last[which]);
            last[which] = said;
            /* All is kept: nothing but rounding is left. */
            if (thresholds[k] == 0) ck_assert_double_le(said, 3e-4 * refine_most(n, x));
        }
        ck_assert_uint_gt(c.S.indptr[n], kept);
        kept = (size_t)c.S.indptr[n];
        free(work);
        compressed_free(&c);
    }
    free(x);
    free(y);
    free(bound);
    free(exact);
    view_free(&v);
}
END_TEST

/* Direct illumination of a whole group is kept, so it is as exact as by F itself. */
START_TEST(groups_are_exact) {
    view v = make_view(CORNELL);
    compressed_factors c = finished(&v, .02);
    const size_t n = v.m.n;
    double *x = test_allocate(n, sizeof *x), *y = test_allocate(n, sizeof *y),
           *exact = test_allocate(n, sizeof *exact), *bound = test_allocate(n, sizeof *bound),
           *work = test_allocate(compressed_work(&c), sizeof *work);
    ck_assert_uint_eq(c.n_lit, v.m.n_groups);
    ck_assert(v.m.emission[0] > 0 || v.m.group[0] != c.lit_group[0]);
    for (size_t g = 0; g < v.m.n_groups; g++) {
        for (size_t i = 0; i < n; i++) x[i] = v.m.group[i] == g;
        csr_multiply_rows(&v.f.F, 0, n, 1, x, exact);
        compressed_multiply(&c, x, y, work, 1);
        ck_assert_double_lt(compressed_error(&c, x, bound, work), 1e-6);
        for (size_t i = 0; i < n; i++) {
            ck_assert_double_eq_tol(y[i], exact[i], 1e-7);
            ck_assert(fabs(y[i] - exact[i]) <= bound[i] + c.rounding);
        }
    }
    free(x);
    free(y);
    free(exact);
    free(bound);
    free(work);
    compressed_free(&c);
    view_free(&v);
}
END_TEST

START_TEST(threads_change_nothing) {
    view v = make_view(CITY);
    compressed_factors one = compress(&v, 1e-4, 1), three = compress(&v, 1e-4, 3);
    const size_t n = v.m.n, nnz = (size_t)one.S.indptr[n];
    ck_assert_mem_eq(one.S.indptr, three.S.indptr, (n + 1) * sizeof *one.S.indptr);
    ck_assert_mem_eq(one.S.indices, three.S.indices, nnz * sizeof *one.S.indices);
    ck_assert_mem_eq(one.S.data, three.S.data, nnz * sizeof *one.S.data);
    ck_assert_mem_eq(one.bound, three.bound, one.basis.n_nodes * one.n_classes * sizeof *one.bound);
    compressed_free(&one);
    compressed_free(&three);
    view_free(&v);
}
END_TEST

static certified subject(const view *v, const char *method, double epsilon, double threshold) {
    double(*centre)[3] = test_allocate(v->m.n, sizeof *centre);
    for (size_t i = 0; i < v->m.n; i++) mesh_centroid(&v->m, i, centre[i]);
    const build_problem problem = {.n = v->m.n,
                                   .n_channels = v->m.n_channels,
                                   .area = v->m.area,
                                   .reflectance = v->m.reflectance,
                                   .F = &v->f.F,
                                   .order = v->order,
                                   .centre = (const double(*)[3])centre,
                                   .normal = (const float(*)[3])v->m.normal};
    const build_options options = options_with(method, epsilon);
    build_report report;
    lam_operator *op = NULL;
    lam_form_factors *F = NULL;
    compressed_factors c = finished(v, threshold);
    ck_ok(build_operator(&problem, &options, &op, &report, &error));
    ck_ok(form_factors_of_compressed(&c, v->m.area, v->f.row_sums, &F, &error));
    free(centre);
    return certified_make_of(v->name, op, F, &v->f.F);
}

/* Certificates count what compression left out: the truth is that of all of F. */
START_TEST(certificates_cover_compression) {
    static const char *const methods[] = {"hierarchical", "low-rank", "exact"};
    view v = make_view(_i);
    const size_t n = v.m.n, C = v.m.n_channels;
    double *E = test_allocate(LIGHTS * C * n, sizeof *E), *H0 = test_allocate(LIGHTS * C * n, sizeof *H0);
    for (int which = 0; which < 4; which++)
        for (size_t c = 0; c < C; c++) light(&v, which, E + ((size_t)which * C + c) * n);
    for (size_t k = 0; k < 4 * C * n; k++) H0[k] = v.m.normal[k % n][2] > 0 ? .5 : 0;
    for (size_t method = 0; method < sizeof methods / sizeof *methods; method++) {
        certified s = subject(&v, methods[method], .1, 1e-6);
        for (lam_quantity q = LAM_RADIOSITY; q <= LAM_INDIRECT; q++)
            for (int lit = 0; lit < 2; lit++) {
                const double share = certified_check(&s, 4, q, E, lit ? H0 : NULL, NULL, .05);
                ck_assert_double_gt(share, 0);
            }
        certified_free(&s);
    }
    /* All of F is there, and what the steps leave is what counts. */
    certified s = subject(&v, "low-rank", .7, 0);
    for (size_t k = 0; k < 2; k++) certified_check(&s, 4, LAM_INDIRECT, E, NULL, NULL, k == 0 ? .05 : .005);
    certified_free(&s);
    free(E);
    free(H0);
    view_free(&v);
}
END_TEST

/* More than compression allows is refused with what it allows; that is then given, and right. */
START_TEST(what_compression_forbids) {
    view v = make_view(BLACK_FLOOR);
    certified s = subject(&v, "exact", .1, _i == 0 ? 1e-4 : 1e-3);
    const size_t count = v.m.n_channels * v.m.n;
    double *E = test_allocate(count, sizeof *E), *out = test_allocate(count, sizeof *out), certificate = -1;
    double reached = 0;
    size_t iterations = 0;
    for (size_t c = 0; c < v.m.n_channels; c++) light(&v, _i == 0 ? 0 : 5, E + c * v.m.n);
    for (size_t k = 0; k < count; k++) E[k] = fmax(E[k], 0);
    ck_assert(lam_refine(s.refiner, 1, LAM_RADIOSITY, E, NULL, NULL, 1e-9, out, &certificate, &iterations,
                         &error) == LAM_ERR_NUMERIC);
    ck_assert_ptr_nonnull(strstr(error.message, "which are compressed; use a larger tolerance"));
    ck_assert_double_eq(certificate, -1);
    ck_assert_int_eq(sscanf(strstr(error.message, "certified to") + 12, "%lg", &reached), 1);
    ck_assert_double_gt(reached, 1e-9);
    certified_check(&s, 1, LAM_INDIRECT, E, NULL, NULL, 1.2 * reached);
    free(E);
    free(out);
    certified_free(&s);
    view_free(&v);
}
END_TEST

/* Where nothing reflects, irradiance lacks what compression left out, and nothing else does. */
START_TEST(black_scenes) {
    view v = make_view(CITY);
    for (size_t k = 0; k < v.m.n_channels * v.m.n; k++) v.m.reflectance[k] = 0;
    certified s = subject(&v, "exact", .1, 1e-2);
    double *E = test_allocate(LIGHTS * v.m.n, sizeof *E);
    ck_assert_uint_eq(v.m.n_channels, 1);
    for (int which = 0; which < 4; which++) light(&v, which, E + (size_t)which * v.m.n);
    ck_assert_double_gt(certified_check(&s, 4, LAM_IRRADIANCE, E, NULL, NULL, .5), 1e-3);
    free(E);
    certified_free(&s);
    view_free(&v);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("compressed");
    TCase *products = tcase_create("products"), *answers = tcase_create("answers");
    tcase_set_timeout(products, 300);
    tcase_set_timeout(answers, 300);
    tcase_add_loop_test(products, doubles_are_the_same_basis, 0, SCENES);
    tcase_add_loop_test(products, bounds_hold, 0, SCENES);
    tcase_add_test(products, groups_are_exact);
    tcase_add_test(products, threads_change_nothing);
    tcase_add_loop_test(answers, certificates_cover_compression, 0, SCENES);
    tcase_add_loop_test(answers, what_compression_forbids, 0, 2);
    tcase_add_test(answers, black_scenes);
    suite_add_tcase(suite, products);
    suite_add_tcase(suite, answers);
    return suite_run(suite);
}
