/* 2MSC against a reference that builds U and V densely, and what must hold whatever the patches. */
#include "solver/base/random.h"
#include "solver/method/method.h"
#include "solver/operator/two_mesh.h"
#include "support/room.h"
#include "support/suite.h"
#include "support/two_mesh.h"

#include <omp.h>

/* V_jp = A_j / A_p for the patches of an operator, [n][k] in mesh order; the caller frees. */
static double *dense_V(const room *r, const operator_patches *patches) {
    double *V = test_allocate(r->m.n * patches->k, sizeof *V);
    for (size_t p = 0; p < patches->k; p++) {
        double area = 0;
        for (uint64_t i = patches->begin[p]; i < patches->begin[p + 1]; i++)
            area += r->m.area[patches->order[i]];
        for (uint64_t i = patches->begin[p]; i < patches->begin[p + 1]; i++)
            V[patches->order[i] * patches->k + p] = r->m.area[patches->order[i]] / area;
    }
    return V;
}

/* P = rho' U (I - V^T R U)^-1 V^T by dense inversion (eqs. 4 and 6), of one channel; the caller frees. */
static double *dense_operator(const room *r, const operator_patches *patches, const float *rho) {
    const size_t n = r->m.n, k = patches->k;
    double *F = room_dense(&r->F), *V = dense_V(r, patches);
    double *U = test_allocate(n * k, sizeof *U), *K = test_allocate(k * k, sizeof *K);
    double *left = test_allocate(n * k, sizeof *left), *P = test_allocate(n * n, sizeof *P);
    for (size_t e = 0; e < n; e++) /* U_ep = sum of F_ej over j in p */
        for (size_t p = 0; p < k; p++)
            for (uint64_t j = patches->begin[p]; j < patches->begin[p + 1]; j++)
                U[e * k + p] += F[e * n + patches->order[j]];
    for (size_t a = 0; a < k; a++)
        for (size_t b = 0; b < k; b++) {
            K[a * k + b] = a == b ? 1 : 0;
            for (size_t i = 0; i < n; i++) K[a * k + b] -= V[i * k + a] * (double)rho[i] * U[i * k + b];
        }
    invert(k, K);
    for (size_t i = 0; i < n; i++)
        for (size_t b = 0; b < k; b++)
            for (size_t a = 0; a < k; a++)
                left[i * k + b] += rho_or_one(rho[i]) * U[i * k + a] * K[a * k + b];
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++)
            for (size_t b = 0; b < k; b++) P[i * n + j] += left[i * k + b] * V[j * k + b];
    free(F);
    free(V);
    free(U);
    free(K);
    free(left);
    return P;
}

/* Rooms: patches within faces (equal elements, no weights), and of several faces (unequal, weights). */
static const struct {
    size_t rank, n_channels;
    bool weighted;
} cases[] = {{20, 1, false}, {20, 3, false}, {6, 1, false}, {4, 1, true},
             {4, 3, true},   {1, 1, true},   {54, 1, false}};

START_TEST(agrees_with_dense_factors) {
    room r = room_create(hall, 3, .5f, cases[_i].n_channels);
    const size_t n = r.m.n, C = cases[_i].n_channels;
    r.m.reflectance[5] = 0; /* a black element receives */
    build_report report;
    lam_operator *op = build_rank(&r, cases[_i].rank, "auto", &report);
    operator_patches patches;
    operator_description about;
    ck_assert(operator_patches_of(op, &patches) && patches.k == cases[_i].rank && patches.order != NULL);
    operator_describe(op, &about);
    /* Y or U in whole cache lines, I, weights only where needed, cores. */
    const size_t stride = (patches.k + 15) / 16 * 16, cores = C > 1 ? C * patches.k * stride * 4 : 0;
    ck_assert_uint_eq(about.bytes,
                      n * stride * 4 + (patches.k + 1) * 8 + (cases[_i].weighted ? 4 * n : 0) + cores);
    float *E = test_allocate(C * n, sizeof *E);
    uint64_t state = 5;
    for (size_t i = 0; i < C * n; i++) E[i] = (float)random_lcg_unit(&state);
    float *B = transport_apply(op, false, 1, LAM_RADIOSITY, E);
    float *H = transport_apply(op, false, 1, LAM_IRRADIANCE, E);
    for (size_t c = 0; c < C; c++) {
        const float *rho = r.m.reflectance + c * n;
        double *P = dense_operator(&r, &patches, rho);
        for (size_t i = 0; i < n; i++) {
            double bounced = 0;
            for (size_t j = 0; j < n; j++) bounced += P[i * n + j] * (double)E[c * n + j];
            const double e = (double)E[c * n + i], b = e + (rho[i] > 0 ? bounced : 0);
            const double h = bounced / rho_or_one(rho[i]);
            ck_assert_double_eq_tol((double)B[c * n + i], b, tolerance(patches.k, .5) * b);
            ck_assert_double_eq_tol((double)H[c * n + i], h, tolerance(patches.k, .5) * h);
        }
        free(P);
    }
    free(E);
    free(B);
    free(H);
    lam_operator_close(op);
    room_free(&r);
}
END_TEST

/* As many patches as elements: nothing is left out, for either factorizer; more cannot be. */
START_TEST(as_many_patches_as_elements_is_exact) {
    static const char *const factorizers[] = {"auto", "qr"};
    room r = room_create(hall, 3, .6f, 1);
    const size_t n = r.m.n;
    double *F = room_dense(&r.F), *P = test_allocate(n * n, sizeof *P);
    bounced_light(n, F, r.m.reflectance, P);
    for (int f = 0; f < 2; f++) {
        build_report report;
        lam_operator *op = build_rank(&r, f == 0 ? n : 10 * n, factorizers[f], &report);
        ck_assert_double_eq(report_get(&report, "rank", -1), (double)n);
        /* S = A^1/2 F A^-1/2 is symmetric only up to the rounding of F; QR rounds in single: n u in the norm.
         */
        ck_assert_double_lt(report_get(&report, "measured_norm_error", -1),
                            f == 0 ? 1e-7 : (double)n * TRANSPORT_U);
        ck_assert_str_eq(lam_operator_kind(op), f == 0 ? "two_mesh" : "low_rank");
        for (size_t s = 0; s < n; s += 7) {
            float E[54] = {0};
            E[s] = 1;
            float *B = transport_apply(op, false, 1, LAM_RADIOSITY, E);
            for (size_t i = 0; i < n;
                 i++) /* QR: S is off by n u, its inverse by n u / (1 - rho)^2 = 6.25 n u */
                ck_assert_double_eq_tol((double)B[i], P[i * n + s] + (i == s ? 1 : 0),
                                        f == 0 ? tolerance(n, .6) : 6.25 * (double)n * TRANSPORT_U);
            free(B);
        }
        lam_operator_close(op);
    }
    free(F);
    free(P);
    room_free(&r);
}
END_TEST

/* Rows of U V^T sum to those of F, so that uniform light in a closed room stays exact: E = 1 gives
 * 1 / (1 - rho) everywhere, at any number of patches, by inclusion or proximity. Rows of F sum to 1 within
 * 1e-7 (single precision), which 1/(1 - rho)^2 magnifies, as it does rounding. */
START_TEST(furnace) {
    static const size_t ranks[] = {1, 3, 6, 10, 31, 54};
    static const float reflectances[] = {.5f, .9f, .9999f};
    for (int proximity = 0; proximity < 2; proximity++)
        for (int f = 0; f < 3; f++) {
            room r = room_create(hall, 3, reflectances[f], 1);
            const double rho = (double)reflectances[f], magnified = 1 / (1 - rho);
            build_options options = build_presets("2msc");
            build_report report;
            set_number(&options, "rank", (double)ranks[_i]);
            set_text(&options, "assign", proximity ? "proximity" : "inclusion");
            lam_operator *op = build_as(room_problem(&r), &options, &report);
            float *E = test_allocate(r.m.n, sizeof *E);
            for (size_t i = 0; i < r.m.n; i++) E[i] = 1;
            float *B = transport_apply(op, false, 1, LAM_RADIOSITY, E);
            for (size_t i = 0; i < r.m.n; i++)
                ck_assert_msg(fabs((double)B[i] - magnified) <=
                                  magnified * (1e-7 * magnified + 2 * sum_roundings(54) * TRANSPORT_U),
                              "rho %g, %zu patches: %.9g, not %.9g", rho, ranks[_i], (double)B[i], magnified);
            free(B);
            free(E);
            lam_operator_close(op);
            room_free(&r);
        }
}
END_TEST

/* Emitted power is absorbed, sum A E = sum A (1 - rho) H, for any light: as columns A_i F~_ij sum to
 * A_j times the mean row sum of the patch, which in a closed room is 1, like those of F. */
START_TEST(power_is_balanced) {
    static const size_t ranks[] = {1, 4, 13, 30};
    room r = room_create(hall, 3, .7f, 1);
    for (int k = 0; k < 4; k++)
        for (int proximity = 0; proximity < 2; proximity++) {
            build_options options = build_presets("2msc");
            build_report report;
            set_number(&options, "rank", (double)ranks[k]);
            set_text(&options, "assign", proximity ? "proximity" : "inclusion");
            lam_operator *op = build_as(room_problem(&r), &options, &report);
            float E[54] = {0};
            for (size_t i = 0; i < 54; i += 7) E[i] = (float)(1 + i % 5);
            float *H = transport_apply(op, false, 1, LAM_IRRADIANCE, E);
            double emitted = 0, absorbed = 0;
            for (size_t i = 0; i < 54; i++) {
                emitted += r.m.area[i] * (double)E[i];
                absorbed += r.m.area[i] * (1 - (double)r.m.reflectance[i]) * (double)H[i];
            }
            /* rows of F are 1 within 1e-7, magnified by 1 / (1 - rho) */
            ck_assert_double_eq_tol(absorbed, emitted, (1e-7 / .3 + tolerance(ranks[k], .7)) * emitted);
            free(H);
            lam_operator_close(op);
        }
    room_free(&r);
}
END_TEST

START_TEST(equal_areas_need_no_weights) {
    room r = room_create(cube, 4, .5f, 1);
    build_report report;
    lam_operator *op = build_rank(&r, 3, "auto", &report);
    operator_description about;
    operator_describe(op, &about);
    ck_assert_uint_eq(about.bytes, r.m.n * 16 * 4 + 4 * 8);
    lam_operator_close(op);
    room_free(&r);
}
END_TEST

START_TEST(defaults_choose_16_elements_a_patch) {
    room r = room_create(cube, 7, .5f, 1); /* 294 */
    const build_options options = build_presets("2msc");
    build_report report;
    lam_operator *op = build_as(room_problem(&r), &options, &report);
    ck_assert_double_eq(report_get(&report, "rank", -1), 19);
    ck_assert_str_eq(report.method, "2msc");
    ck_assert(report_get(&report, "coherence_min", 0) > .3 && report_get(&report, "coherence_min", 1) < 1 &&
              report_get(&report, "patch_area_min", 0) > 0);
    ck_assert(report_get(&report, "epsilon", -1) == report_get(&report, "measured_norm_error", -1) &&
              report_get(&report, "epsilon", -1) > 0 && report_get(&report, "epsilon", -1) < 1);
    ck_assert_ptr_nonnull(strstr(report.reason, "19 patches of 294 elements by inclusion, coherence"));
    lam_operator_close(op);
    room_free(&r);
}
END_TEST

/* |S - S W W^T|_2 by power iteration on a dense matrix in double; Lanczos is a per cent below at most. */
START_TEST(the_norm_of_the_error_is_measured) {
    room r = room_create(hall, 3, .5f, 1);
    const size_t n = r.m.n;
    double *D = room_dense(&r.F), *x = test_allocate(n, sizeof *x), *y = test_allocate(n, sizeof *y),
           norm = 0;
    build_report report;
    operator_patches patches;
    lam_operator *op = build_rank(&r, 4 + 9 * (size_t)_i, "auto", &report);
    ck_assert(operator_patches_of(op, &patches));
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) D[i * n + j] *= sqrt(r.m.area[i] / r.m.area[j]);
    for (size_t i = 0; i < n; i++)
        for (size_t p = 0; p < patches.k; p++) { /* D = S - S W W^T */
            double area = 0, along = 0;
            for (uint64_t q = patches.begin[p]; q < patches.begin[p + 1]; q++) {
                area += r.m.area[patches.order[q]];
                along += D[i * n + patches.order[q]] * sqrt(r.m.area[patches.order[q]]);
            }
            for (uint64_t q = patches.begin[p]; q < patches.begin[p + 1]; q++)
                D[i * n + patches.order[q]] -= along * sqrt(r.m.area[patches.order[q]]) / area;
        }
    for (size_t i = 0; i < n; i++) x[i] = 1 + (double)(i * i % 7);
    for (int step = 0; step < 2000; step++) {
        double length = 0;
        for (size_t i = 0; i < n; i++) length += x[i] * x[i];
        for (size_t i = 0; i < n; i++) x[i] /= sqrt(length);
        norm = 0;
        for (size_t i = 0; i < n; i++) {
            y[i] = 0;
            for (size_t j = 0; j < n; j++) y[i] += D[i * n + j] * x[j];
            norm += y[i] * y[i];
        }
        for (size_t j = 0; j < n; j++) {
            x[j] = 0;
            for (size_t i = 0; i < n; i++) x[j] += D[i * n + j] * y[i];
        }
    }
    ck_assert_double_eq_tol(report_get(&report, "measured_norm_error", -1), sqrt(norm), .01 * sqrt(norm));
    lam_operator_close(op);
    free(D);
    free(x);
    free(y);
    room_free(&r);
}
END_TEST

/* S~ = Q Q^T S with Q's span holding that of S W: the best in that span, so no worse than S W W^T. */
START_TEST(qr_is_no_worse) {
    room r = room_create(hall, 6, .5f, 1);
    for (size_t rank = 6; rank < 200; rank *= 2) {
        build_report plain, qr;
        lam_operator_close(build_rank(&r, rank, "auto", &plain));
        lam_operator_close(build_rank(&r, rank, "qr", &qr));
        ck_assert(report_is(&qr, "factorizer", "qr") && report_is(&plain, "factorizer", "none"));
        ck_assert_double_eq(report_get(&qr, "rank", -1), (double)rank);
        /* Lanczos is a per cent below at most. */
        ck_assert_double_le(report_get(&qr, "measured_norm_error", -1),
                            1.02 * report_get(&plain, "measured_norm_error", -1));
    }
    room_free(&r);
}
END_TEST

/* The norms of both are at most that of S, which in a closed room is 1: no reflectance below 1 can make light
 * grow without end. E >= 0 of one element, rho = .9999: power received is at most sum A E / (1 - rho). */
START_TEST(norms_cannot_pass_one) {
    static const char *const factorizers[] = {"auto", "qr"};
    room r = room_create(hall, 3, .9999f, 1);
    for (int f = 0; f < 2; f++)
        for (size_t rank = 1; rank <= 54; rank += 9) {
            build_report report;
            lam_operator *op = build_rank(&r, rank, factorizers[f], &report);
            ck_assert_double_gt(report_get(&report, "rcond", -1), 1e-8);
            for (size_t s = 0; s < 54; s += 5) {
                float E[54] = {0};
                double norm_E = sqrt(r.m.area[s]), norm_B = 0;
                E[s] = 1;
                float *B = transport_apply(op, false, 1, LAM_RADIOSITY, E);
                for (size_t i = 0; i < 54; i++) norm_B += r.m.area[i] * (double)B[i] * (double)B[i];
                /* |(I - R S~)^-1| <= 1 / (1 - rho), and rounding of 54 u / (1 - rho) = .03 on it */
                ck_assert_double_le(sqrt(norm_B), 1.04 * norm_E / (1 - .9999));
                free(B);
            }
            lam_operator_close(op);
        }
    room_free(&r);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("two meshes");
    TCase *tests = tcase_create("two meshes");
    tcase_set_timeout(tests, 300);
    tcase_add_loop_test(tests, agrees_with_dense_factors, 0, (int)(sizeof cases / sizeof *cases));
    tcase_add_test(tests, as_many_patches_as_elements_is_exact);
    tcase_add_loop_test(tests, furnace, 0, 6);
    tcase_add_test(tests, power_is_balanced);
    tcase_add_test(tests, equal_areas_need_no_weights);
    tcase_add_test(tests, defaults_choose_16_elements_a_patch);
    tcase_add_loop_test(tests, the_norm_of_the_error_is_measured, 0, 3);
    tcase_add_test(tests, qr_is_no_worse);
    tcase_add_test(tests, norms_cannot_pass_one);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
