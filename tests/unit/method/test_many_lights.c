/* The light of many emissions at once against the dense solution in double. */
#include "solver/base/random.h"
#include "solver/method/many_lights.h"
#include "solver/method/reference.h"
#include "support/suite.h"
#include "support/transport.h"

#include <omp.h>

enum { N = 230 };

/* Form factors with reciprocity, a third of them 0, row sums up to `closed`; areas over four decades. */
typedef struct room {
    csr F;
    double area[N];
    float rho[N];
} room;

static void make_room(double closed, uint64_t seed, room *r) {
    double *G = test_allocate((size_t)N * N, sizeof *G), largest = 0;
    uint64_t entries = 0;
    for (size_t i = 0; i < N; i++) r->area[i] = pow(10, 4 * random_lcg_unit(&seed) - 2);
    for (size_t i = 0; i < N; i++)
        for (size_t j = 0; j < i; j++)
            if (random_lcg_unit(&seed) > .33)
                G[i * N + j] = G[j * N + i] = random_lcg_unit(&seed) * r->area[i] * r->area[j];
    for (size_t i = 0; i < N; i++) {
        double sum = 0;
        for (size_t j = 0; j < N; j++) sum += G[i * N + j] / r->area[i];
        largest = fmax(largest, sum);
    }
    r->F = (csr){.n = N,
                 .indptr = test_allocate(N + 1, sizeof *r->F.indptr),
                 .indices = test_allocate((size_t)N * N, sizeof *r->F.indices),
                 .data = test_allocate((size_t)N * N, sizeof *r->F.data)};
    for (size_t i = 0; i < N; i++) {
        for (size_t j = 0; j < N; j++) {
            if (!(G[i * N + j] > 0)) continue;
            r->F.indices[entries] = (uint32_t)j;
            r->F.data[entries++] = (float)(closed * G[i * N + j] / r->area[i] / largest);
        }
        r->F.indptr[i + 1] = entries;
        r->rho[i] = i % 6 == 3 ? 0 : (float)(.2 + .75 * random_lcg_unit(&seed));
    }
    free(G);
}

static many_lights_input problem_of(const room *r, size_t m, const float *E, const float *H0) {
    return (many_lights_input){.n = N, .F = &r->F, .area = r->area, .rho = r->rho, .m = m, .E = E, .H0 = H0};
}

static float *random_light(size_t m, uint64_t seed) {
    float *E = test_allocate(m * N, sizeof *E);
    for (size_t k = 0; k < m * N; k++) E[k] = random_lcg_unit(&seed) < .1 ? (float)random_lcg_unit(&seed) : 0;
    return E;
}

/* rho' H in double: H = H0 + F B. */
static double *exact_light(const room *r, size_t m, const float *E, const float *H0) {
    double *lit = test_allocate(m * N, sizeof *lit), *B = test_allocate(m * N, sizeof *B);
    double *T = test_allocate(m * N, sizeof *T);
    lam_error error = {0};
    reference *judge = NULL;
    for (size_t k = 0; k < m * N; k++)
        lit[k] = (E != NULL ? (double)E[k] : 0) + (H0 != NULL ? (double)r->rho[k % N] * (double)H0[k] : 0);
    ck_assert_int_eq(reference_create(&r->F, r->area, r->rho, REFERENCE_DENSE, &judge, &error), LAM_OK);
    ck_assert_int_eq(reference_solve(judge, m, lit, B, 0, NULL, &error), LAM_OK);
    for (size_t v = 0; v < m; v++)
        for (size_t i = 0; i < N; i++) {
            double H = H0 != NULL ? (double)H0[v * N + i] : 0;
            for (uint64_t e = r->F.indptr[i]; e < r->F.indptr[i + 1]; e++)
                H += (double)r->F.data[e] * B[v * N + r->F.indices[e]];
            T[v * N + i] = rho_or_one(r->rho[i]) * H;
        }
    reference_destroy(judge);
    free(lit);
    free(B);
    return T;
}

/* |T - exact| / |exact| by area, of the worst vector. */
static double worst_error(const room *r, size_t m, const float *T, const double *exact) {
    double worst = 0;
    for (size_t v = 0; v < m; v++) {
        double off = 0, all = 0;
        for (size_t i = 0; i < N; i++) {
            const double e = (double)T[v * N + i] - exact[v * N + i];
            off += r->area[i] * e * e;
            all += r->area[i] * exact[v * N + i] * exact[v * N + i];
        }
        worst = fmax(worst, sqrt(off / all));
    }
    return worst;
}

START_TEST(light_is_that_of_the_dense_solution) {
    static const size_t batches[] = {1, 5, 9, 17, 32, 41};
    room r;
    make_room(.98, 3, &r);
    for (size_t b = 0; b < sizeof batches / sizeof *batches; b++)
        for (int lights = 1; lights <= 3; lights++) {
            const size_t m = batches[b];
            float *E = lights & 1 ? random_light(m, 5) : NULL, *H0 = lights & 2 ? random_light(m, 7) : NULL;
            float *T = test_allocate(m * N, sizeof *T);
            double *exact = exact_light(&r, m, E, H0);
            const many_lights_input c = problem_of(&r, m, E, H0);
            many_lights_report report;
            lam_error error = {0};
            ck_assert_msg(many_lights_solve(&c, 1e-6, T, &report, &error) == LAM_OK, "%s", error.message);
            ck_assert_double_le(report.residual, 1e-6);
            /* The residual bounds the error by 1 / (1 - largest rho) in the scaled norm. */
            ck_assert_double_le(worst_error(&r, m, T, exact), 2e-5);
            free(E);
            free(H0);
            free(T);
            free(exact);
        }
    csr_free(&r.F);
}
END_TEST

START_TEST(bits_do_not_depend_on_threads) {
    enum { M = 11 };
    room r;
    make_room(.98, 9, &r);
    float *E = random_light(M, 2), *one = test_allocate(M * N, sizeof *one),
          *four = test_allocate(M * N, sizeof *four);
    const many_lights_input c = problem_of(&r, M, E, NULL);
    many_lights_report report;
    omp_set_num_threads(1);
    ck_assert_int_eq(many_lights_solve(&c, 1e-6, one, &report, NULL), LAM_OK);
    omp_set_num_threads(4);
    ck_assert_int_eq(many_lights_solve(&c, 1e-6, four, &report, NULL), LAM_OK);
    ck_assert_mem_eq(one, four, M * N * sizeof *one);
    free(E);
    free(one);
    free(four);
    csr_free(&r.F);
}
END_TEST

/* A sweep by hand, and that many sweeps end at the same light. */
START_TEST(jacobi_sweeps_as_the_equation_says) {
    enum { M = 3, SWEEPS = 4 };
    room r;
    make_room(.98, 4, &r);
    float *E = random_light(M, 2), *H0 = random_light(M, 6), *T = test_allocate(M * N, sizeof *T);
    double *B = test_allocate(N, sizeof *B), *H = test_allocate(N, sizeof *H);
    const many_lights_input c = problem_of(&r, M, E, H0);
    ck_assert_int_eq(many_lights_jacobi(&c, SWEEPS, T, NULL), LAM_OK);
    for (size_t v = 0; v < M; v++) {
        for (size_t i = 0; i < N; i++) B[i] = (double)E[v * N + i] + (double)r.rho[i] * (double)H0[v * N + i];
        for (int sweep = 0; sweep < SWEEPS; sweep++) {
            for (size_t i = 0; i < N; i++) {
                H[i] = (double)H0[v * N + i];
                for (uint64_t e = r.F.indptr[i]; e < r.F.indptr[i + 1]; e++)
                    H[i] += (double)r.F.data[e] * B[r.F.indices[e]];
            }
            for (size_t i = 0; i < N; i++) B[i] = (double)E[v * N + i] + (double)r.rho[i] * H[i];
        }
        for (size_t i = 0; i < N; i++)
            ck_assert_double_eq_tol((double)T[v * N + i], rho_or_one(r.rho[i]) * H[i],
                                    1e-5 * (rho_or_one(r.rho[i]) * H[i] + 1e-6));
    }
    double *exact = exact_light(&r, M, E, H0);
    ck_assert_int_eq(many_lights_jacobi(&c, 600, T, NULL), LAM_OK);
    ck_assert_double_le(worst_error(&r, M, T, exact), 2e-5);
    free(exact);
    free(E);
    free(H0);
    free(T);
    free(B);
    free(H);
    csr_free(&r.F);
}
END_TEST

/* Two plates that keep nearly all light between them: an answer, or an error that says what to do. */
START_TEST(nearly_no_loss_ends) {
    uint64_t indptr[] = {0, 1, 2};
    uint32_t indices[] = {1, 0};
    float data[] = {1, 1}, rho[] = {0x1.fffffep-1f, 0x1.fffffep-1f}, E[] = {1, 0, 0, 0}, T[4];
    const double area[] = {1, 1};
    const csr F = {.n = 2, .indptr = indptr, .indices = indices, .data = data};
    const many_lights_input c = {.n = 2, .F = &F, .area = area, .rho = rho, .m = 2, .E = E};
    many_lights_report report;
    lam_error error = {0};
    const lam_status status = many_lights_solve(&c, 1e-6, T, &report, &error);
    if (status == LAM_OK)
        for (int k = 0; k < 4; k++) ck_assert(isfinite(T[k]));
    else
        ck_assert_ptr_nonnull(strstr(error.message, "lower the largest reflectance"));
}
END_TEST

/* A row of elements that see only their neighbours: light goes from one end to the other in as many bounces,
 * and conjugate gradients need far fewer products. */
START_TEST(gradients_are_conjugate) {
    enum { LINE = 400 };
    uint64_t indptr[LINE + 1] = {0};
    uint32_t indices[2 * LINE];
    float data[2 * LINE], rho[LINE], E[LINE] = {1}, T[LINE];
    double area[LINE];
    size_t entries = 0;
    for (uint32_t i = 0; i < LINE; i++) {
        area[i] = 1;
        rho[i] = .95f;
        if (i > 0) indices[entries] = i - 1, data[entries++] = .5f;
        if (i + 1 < LINE) indices[entries] = i + 1, data[entries++] = .5f;
        indptr[i + 1] = entries;
    }
    const csr F = {.n = LINE, .indptr = indptr, .indices = indices, .data = data};
    const many_lights_input c = {.n = LINE, .F = &F, .area = area, .rho = rho, .m = 1, .E = E};
    many_lights_report report;
    ck_assert_int_eq(many_lights_solve(&c, 1e-6, T, &report, NULL), LAM_OK);
    ck_assert_uint_le(report.sweeps, 55); /* 44; by directions that are not conjugate 84 */
}
END_TEST

static bool at_once(void *context) {
    (void)context;
    return true;
}

START_TEST(stops_when_told) {
    room r;
    make_room(.98, 4, &r);
    float *E = random_light(2, 2), T[2 * N];
    const progress told = {.cancelled = at_once};
    many_lights_input c = problem_of(&r, 2, E, NULL);
    many_lights_report report;
    lam_error error = {0};
    c.progress = &told;
    ck_assert_int_eq(many_lights_solve(&c, 1e-6, T, &report, &error), LAM_ERR_CANCELLED);
    ck_assert_int_eq(many_lights_jacobi(&c, 9, T, &error), LAM_ERR_CANCELLED);
    free(E);
    csr_free(&r.F);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("columns");
    TCase *cases = tcase_create("columns");
    tcase_set_timeout(cases, 120); /* threads that wait for a core that others have */
    tcase_add_test(cases, light_is_that_of_the_dense_solution);
    tcase_add_test(cases, bits_do_not_depend_on_threads);
    tcase_add_test(cases, jacobi_sweeps_as_the_equation_says);
    tcase_add_test(cases, nearly_no_loss_ends);
    tcase_add_test(cases, gradients_are_conjugate);
    tcase_add_test(cases, stops_when_told);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
