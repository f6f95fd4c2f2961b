/* Operators where numbers are hard: nothing ends in NaN, infinity, a radiosity more negative than the error
 * allows, or a crash; what cannot be done is refused with a remedy. */
#include "solver/base/random.h"
#include "solver/base/work_area.h"
#include "solver/linalg/panel.h"
#include "support/building.h"
#include "support/suite.h"
#include "tests/bench/suites/stability.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The last is the largest reflectance that single precision has. Sanitizers watch the same code with two of
 * them; tests/run.sh has all of them in the optimised build too. */
#ifdef LAMBERT_FEW_CASES
static const double rhos[] = {.9, 1 - 0x1p-24};
#else
static const double rhos[] = {.5, .9, .99, .999, .9999, 1 - 0x1p-24};
#endif
enum { RHOS = sizeof rhos / sizeof *rhos };

static const stability_way ways[] = {
    {"exact", "auto", .05, 0},      {"low-rank", "hf", .05, 0},     {"low-rank", "hf", 1, 0},
    {"low-rank", "hf", 1e-4, 0},    {"low-rank", "svd", .05, 0},    {"low-rank", "rsi", .05, 0},
    {"low-rank", "sgrsvd", .1, 0},  {"low-rank", "hf", .05, 1},     {"low-rank", "svd", .05, 1},
    {"low-rank", "rsi", .05, 1},    {"low-rank", "sgrsvd", .05, 1}, {"low-rank", "hf", .05, 9999},
    {"low-rank", "svd", .05, 9999}, {"low-rank", "rsi", .05, 9999}, {"low-rank", "sgrsvd", .05, 9999},
    {"2msc", NULL, 0, 0},           {"sparse", NULL, 0, 0},         {"emitters", NULL, 0, 0},
    {"hierarchical", NULL, .05, 0}, {"hierarchical", NULL, .003, 0}};
enum { WAYS = sizeof ways / sizeof *ways };

/* The relative error that a way allows, of reflectances up to `most`. Factors have their bound. Emitters are
 * iterated to a residual of 1e-6. A sparse inverse drops less than 1e-4 of each entry of a bounce, and
 * bounces make 1 / (1 - rho) of it. Uniform light is put into hierarchical operators exactly, so that what
 * they drop does not add up from bounce to bounce: epsilon, whatever is reflected. */
static double error_of(const stability_problem *p, const stability_way *way, const stability_result *r,
                       double most) {
    if (strcmp(way->method, "hierarchical") == 0) return way->epsilon;
    if (strcmp(way->method, "emitters") == 0) return 1e-6 / (1 - most);
    if (strcmp(way->method, "sparse") == 0) return (double)p->n * 1e-4 / (1 - most);
    return r->bound;
}

static void check(const stability_problem *p, double rho, const stability_way *way) {
    stability_result r;
    lam_error error = {0};
    ck_assert_msg(stability_try(p, way, &r, &error) == LAM_OK, "%s", error.message);
    if (r.status != LAM_OK) {
        ck_assert_msg(r.status == LAM_ERR_NUMERIC && strstr(r.message, "use ") != NULL,
                      "%s, rho %g, %s %s: refused without a remedy: %s", p->name, rho, way->method,
                      way->factorizer != NULL ? way->factorizer : "", r.message);
        return;
    }
    /* The rounding of single precision: an n-th part of n rounded entries weighs as one, and a bounce that
     * loses 1 - rho of its light makes 1 / (1 - rho) of it; twenty for the steps between. */
    double most = 0;
    for (size_t i = 0; i < p->n; i++) most = fmax(most, (double)p->reflectance[i]);
    const double rounding = 20 * (double)FLT_EPSILON / (1 - most);
    const double allowed = error_of(p, way, &r, most) + rounding;
#define CHECK(condition, what)                                                                               \
    ck_assert_msg(condition,                                                                                 \
                  "%s, rho %.9g, %s %s, epsilon %g, rank %zu: %s (relative %g, bound %g, negative %g, "      \
                  "energy %g, linearity %g, reciprocity %g, norm %g)",                                       \
                  p->name, rho, way->method, way->factorizer != NULL ? way->factorizer : "", way->epsilon,   \
                  way->rank, what, r.relative, r.bound, r.negative, r.energy, r.linearity, r.reciprocity,    \
                  r.norm)
    CHECK(r.finite, "not finite");
    CHECK(r.relative <= allowed, "error beyond its bound");
    /* No single B is further off than all together, and a bright one is among them. */
    CHECK(r.negative <= fmax(1e-6, sqrt((double)p->n) * allowed), "negative");
    CHECK(r.linearity <= 2e-6, "not linear");
    /* H is off by at most |S~ - S| |B| and by what B is off. A sparse inverse drops by F_ij, so that light of
     * an element that is tiny beside all others is lost. */
    const double known = r.bound > 0 ? fmax(r.norm, 1e-6) / (1 - most) : fmax(allowed, 1e-6 / (1 - most));
    if (strcmp(way->method, "sparse") != 0) CHECK(r.energy <= 1e-6 + known + rounding, "energy is lost");
    if (strcmp(way->method, "exact") == 0) CHECK(r.reciprocity <= 1e-5, "not reciprocal");
    if (way->factorizer == NULL || strcmp(way->factorizer, "sgrsvd") != 0)
        CHECK(strcmp(way->method, "2msc") == 0 || r.norm <= 1 + 1e-5,
              "a part of S that is larger than S"); /* S (I - V V^T) is not */
    if (strcmp(way->method, "hierarchical") == 0) CHECK(r.reciprocity <= 1e-5, "not reciprocal");
    if (way->rank >= p->n) CHECK(r.norm <= 1e-5, "the whole rank leaves something out");
#undef CHECK
}

START_TEST(hard_numbers) {
    stability_problem p = {0};
    lam_error error = {0};
    const int which = _i / RHOS;
    const double rho = rhos[_i % RHOS];
    if (which == STABILITY_BLACK && _i % RHOS > 0) return; /* it has none */
    ck_assert_msg(stability_make(which, rho, &p, &error) == LAM_OK, "%s", error.message);
    for (size_t w = 0; w < WAYS; w++)
        if (stability_can(&p, &ways[w])) check(&p, rho, &ways[w]);
    stability_free(&p);
}
END_TEST

/* Sums over more elements than any scene of the papers has: single precision loses nothing that counts. */
START_TEST(long_sums_are_right) {
    enum { N = 3538944, K = 2 };
    lam_error error = {0};
    panel a;
    float *rows = malloc((size_t)N * K * sizeof *rows), *x = malloc(N * sizeof *x), t[16];
    ck_assert(rows != NULL && x != NULL);
    double exact[K] = {0}, size[K] = {0};
    uint64_t state = 5;
    for (size_t i = 0; i < N; i++) {
        x[i] = 1 + (float)(i % 1000) * 1e-3f;
        for (size_t k = 0; k < K; k++) {
            /* All of one sign, the worst for a running sum; and of both. */
            const double u = random_lcg_unit(&state);
            rows[i * K + k] = (float)(k == 0 ? u : u - .5);
            exact[k] += (double)rows[i * K + k] * (double)x[i];
            size[k] += fabs((double)rows[i * K + k] * (double)x[i]);
        }
    }
    ck_assert_msg(panel_create(N, K, rows, "A", &a, &error) == LAM_OK, "%s", error.message);
    char *work = malloc(panel_work_bytes(&a, 1) + WORK_AREA_ALIGN);
    panel_project(&a, 1, x, N, t, K,
                  work + (WORK_AREA_ALIGN - (uintptr_t)work % WORK_AREA_ALIGN) % WORK_AREA_ALIGN);
    /* Blocks of 128 rows in single precision, their sums in double: 128 roundings of a block. */
    for (size_t k = 0; k < K; k++)
        ck_assert_double_le(fabs((double)t[k] - exact[k]), 128 * (double)FLT_EPSILON / 2 * size[k]);
    ck_assert_double_le(fabs((double)t[0] - exact[0]), 1e-6 * exact[0]);
    panel_free(&a);
    free(work);
    free(rows);
    free(x);
}
END_TEST

/* The smallest numbers there are scale like any others, down to their own rounding. */
START_TEST(denormals_are_numbers) {
    stability_problem p = {0};
    lam_error error = {0};
    ck_assert_int_eq(stability_make(STABILITY_ROOM, .5, &p, &error), LAM_OK);
    const build_problem problem = {
        .n = p.n, .n_channels = 1, .area = p.area, .reflectance = p.reflectance, .F = &p.F, .order = p.order};
    build_options how = build_presets("low-rank");
    set_text(&how, "factorizer", "hf");
    build_report report;
    lam_operator *op = NULL;
    ck_assert_int_eq(build_operator(&problem, &how, &op, &report, &error), LAM_OK);
    const size_t bytes = lam_operator_work_bytes(op, 1);
    void *work = malloc(bytes);
    float *E = calloc(p.n, sizeof *E), *one = malloc(p.n * sizeof *one), *B = malloc(p.n * sizeof *B);
    const float scales[] = {1, 1e-30f, 1e-37f, 1e-41f, 1e30f};
    for (int s = 0; s < 5; s++) {
        for (size_t i = 0; i < p.n; i++) E[i] = i % 3 == 0 ? scales[s] : 0;
        ck_assert_int_eq(lam_operator_apply(op, 1, LAM_RADIOSITY, E, B, work, bytes, &error), LAM_OK);
        for (size_t i = 0; i < p.n; i++) {
            if (s == 0) one[i] = B[i];
            ck_assert(isfinite(B[i]));
            /* n products, each rounded to the spacing of denormals at worst. */
            ck_assert_double_le(fabs((double)B[i] - (double)scales[s] * (double)one[i]),
                                1e-5 * (double)scales[s] * fabs((double)one[i]) +
                                    2 * (double)p.n * (double)FLT_TRUE_MIN);
        }
    }
    lam_operator_close(op);
    free(work);
    free(E);
    free(one);
    free(B);
    stability_free(&p);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("stability");
    TCase *cases = tcase_create("stability");
    tcase_set_timeout(cases, 600);
    tcase_add_loop_test(cases, hard_numbers, 0, STABILITY_PROBLEMS * RHOS);
    tcase_add_test(cases, long_sums_are_right);
    tcase_add_test(cases, denormals_are_numbers);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
