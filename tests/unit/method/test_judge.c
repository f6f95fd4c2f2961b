/* The figures of the judge against those of dense solutions, element by element: of an operator that is off,
 * with two channels, against form factors of another sample, first light that is known, and the spread of
 * both halves. */
#include "solver/method/judge.h"
#include "solver/method/reference.h"
#include "support/box.h"
#include "support/suite.h"

#include "store/status.h"

enum { SIDE = 2, N = 6 * SIDE * SIDE, C = 2, VECTOR = C * N };
enum { OWN, BETTER, HALF, OTHER_HALF, SAMPLES };

static const double size[3] = {10, 6, 3};

typedef struct subject {
    mesh m;
    csr F[SAMPLES];
    float rho[VECTOR], emission[VECTOR];
    double row_sums[N];
    lam_operator *op;
    float B[N][VECTOR]; /* the operator's answers to single elements */
} subject;

/* F of a box, each exchange area off by up to this share. */
static csr disturbed(const mesh *m, double off, size_t seed) {
    csr F = box_form_factors(size, SIDE, m->area);
    for (size_t i = 0; i < N; i++)
        for (uint64_t p = F.indptr[i]; p < F.indptr[i + 1]; p++) {
            const size_t j = F.indices[p], key = (i + j) * (seed + 3) + i * j * (seed + 7);
            F.data[p] *= (float)(1 + off * ((double)(key % 101) / 50 - 1));
        }
    return F;
}

/* Light of element e on i that no sample knows. */
static double first_of(size_t e, size_t i) {
    return i == e ? 0 : .03 + .002 * (double)((i + 2 * e) % 3);
}

/* The converged B of E [C][n]; the light of the bright element e itself is first_of where that is known. */
static void solve(const subject *s, const csr *F, const double *E, size_t e, bool known, double *B) {
    lam_error error = {.message = ""};
    for (size_t c = 0; c < C; c++) {
        const float *rho = s->rho + c * N;
        double emitted[N], light[N];
        reference *r = NULL;
        csr_multiply_rows(F, 0, N, 1, E + c * N, light);
        for (size_t i = 0; i < N; i++)
            emitted[i] =
                E[c * N + i] + (known ? (double)rho[i] * (E[c * N + e] * first_of(e, i) - light[i]) : 0);
        ck_ok(reference_create(F, s->m.area, rho, REFERENCE_DENSE, &r, &error));
        ck_ok(reference_solve(r, 1, emitted, B + c * N, 0, NULL, &error));
        reference_destroy(r);
    }
}

/* Emission of one element. */
static void light_up(size_t e, double *E) {
    memset(E, 0, VECTOR * sizeof *E);
    for (size_t c = 0; c < C; c++) E[c * N + e] = 1;
}

/* An exact operator of another sample, rounded to three digits. */
static void subject_make(subject *s) {
    static const double off[SAMPLES] = {.02, .1, .15, .2};
    lam_error error = {.message = ""};
    float *P = malloc(C * N * N * sizeof *P);
    s->m = box_mesh(size, SIDE, .5f);
    for (size_t k = 0; k < SAMPLES; k++) s->F[k] = disturbed(&s->m, off[k], k);
    for (size_t i = 0; i < VECTOR; i++) {
        s->rho[i] = i < N ? .3f + .02f * (float)(i % 5) : .6f - .01f * (float)(i % 4);
        s->emission[i] = i % N == 7 ? 2 : 0;
    }
    for (size_t i = 0; i < N; i++) s->row_sums[i] = 1;
    for (size_t e = 0; e < N; e++) {
        double E[VECTOR], B[VECTOR];
        light_up(e, E);
        solve(s, &s->F[OWN], E, e, false, B);
        for (size_t k = 0; k < VECTOR; k++) {
            const float p = (float)((B[k] - E[k]) * (1 + .01 * ((double)((k + e) % 5) - 2)));
            P[(k / N * N + k % N) * N + e] = p;
            s->B[e][k] = (float)E[k] + p;
        }
    }
    ck_ok(operator_exact_create(N, C, s->rho, P, &s->op, &error));
}

static void subject_free(subject *s) {
    lam_operator_close(s->op);
    for (size_t k = 0; k < SAMPLES; k++) csr_free(&s->F[k]);
    mesh_free(&s->m);
}

/* A flag for known first light, and the elements in the order of the probes. */
typedef struct lighting {
    bool known;
    size_t order[N + 1], count;
} lighting;

static lam_status known_light(void *context, const float *E, double *H, bool *known, lam_error *error) {
    lighting *l = context;
    size_t count = 0, e = 0;
    (void)error;
    for (size_t i = 0; i < N; i++)
        if (E[i] > 0) count++, e = i;
    if (l->count <= N) l->order[l->count++] = e;
    *known = l->known && count == 1;
    for (size_t i = 0; *known && i < N; i++) H[i] = (double)E[e] * first_of(e, i);
    return LAM_OK;
}

/* |share (x - y)| / |(x + y) / 2 - E|, by area, of [C][n]. */
static double figure(const subject *s, double share, const double *x, const double *y, const double *of,
                     const double *E) {
    double off = 0, all = 0;
    for (size_t k = 0; k < VECTOR; k++) {
        off += s->m.area[k % N] * share * share * (x[k] - y[k]) * (x[k] - y[k]);
        all += s->m.area[k % N] * (of[k] - E[k]) * (of[k] - E[k]);
    }
    return sqrt(off / all);
}

/* Of all elements, and the noise of the first ones, the slow way. */
typedef struct expected {
    double operator_mean, total_mean, total_max, noise;
} expected;

static expected find_expected(const subject *s, const lighting *l, bool halves_of_their_own) {
    const bool known = l->known;
    expected out = {0};
    for (size_t v = 0; v < N; v++) {
        const size_t e = l->order[v];
        double E[VECTOR], own[VECTOR], better[VECTOR], half[2][VECTOR], mean[VECTOR], B[VECTOR];
        light_up(e, E);
        for (size_t k = 0; k < VECTOR; k++) B[k] = (double)s->B[e][k];
        solve(s, &s->F[OWN], E, e, false, own);
        solve(s, &s->F[BETTER], E, e, known, better);
        solve(s, &s->F[halves_of_their_own ? HALF : BETTER], E, e, known, half[0]);
        solve(s, &s->F[OTHER_HALF], E, e, known, half[1]);
        for (size_t k = 0; k < VECTOR; k++) mean[k] = .5 * (half[0][k] + half[1][k]);
        const double total = figure(s, 1, B, better, better, E);
        out.operator_mean += figure(s, 1, B, own, own, E) / N;
        out.total_mean += total / N;
        out.total_max = fmax(out.total_max, total);
        if (v < JUDGE_NOISE_PROBES)
            out.noise += figure(s, .5, half[0], half[1], mean, E) / JUDGE_NOISE_PROBES;
    }
    return out;
}

/* Corrections are found to four digits of themselves, and the halves' corrections are up to ten times their
 * distance. */
static void check_close(double found, double wanted, double share) {
    ck_assert_double_gt(wanted, 1e-3);
    ck_assert_double_eq_tol(found, wanted, share * wanted);
}

static lam_status multiply(const void *context, size_t m, const double *x, double *y, lam_error *error) {
    (void)error;
    csr_multiply_rows(context, 0, N, m, x, y);
    return LAM_OK;
}

/* Form factors as rows, which so few elements solve by an LU, or as what can only be multiplied with, whose
 * solutions the operator guides. */
static factor_product product_of(const csr *F, bool as_rows) {
    return as_rows ? factor_product_of_rows(F) : (factor_product){.n = N, .multiply = multiply, .context = F};
}

START_TEST(figures_are_those_of_dense_solutions) {
    lighting lights = {.known = _i & 1};
    const bool halves_of_their_own = _i & 2, as_rows = _i & 4;
    subject s;
    error_report report;
    lam_error error = {.message = ""};
    subject_make(&s);
    const build_problem problem = {
        .n = N, .n_channels = C, .area = s.m.area, .reflectance = s.rho, .F = &s.F[OWN]};
    const judge_input input = {.problem = &problem,
                               .row_sums = s.row_sums,
                               .emission = s.emission,
                               .own = product_of(&s.F[OWN], as_rows),
                               .independent = product_of(&s.F[BETTER], as_rows),
                               .halves = {product_of(&s.F[halves_of_their_own ? HALF : BETTER], as_rows),
                                          product_of(&s.F[OTHER_HALF], as_rows)},
                               .first_light = known_light,
                               .first_light_context = &lights,
                               .probes = N,
                               .seed = 5};
    ck_ok(judge_operator(s.op, &input, &report, &error));
    const expected wanted = find_expected(&s, &lights, halves_of_their_own);
    ck_assert_uint_eq(report.single.probes, N);
    check_close(report.single.operator_indirect.mean, wanted.operator_mean, 2e-4);
    check_close(report.single.total_indirect.mean, wanted.total_mean, 2e-4);
    check_close(report.single.total_indirect.max, wanted.total_max, 2e-4);
    check_close(report.single.reference_noise, wanted.noise, 2e-3);
    /* The scene's own light is that of element 7. */
    double E[VECTOR], B[VECTOR], better[VECTOR];
    light_up(7, E);
    for (size_t k = 0; k < VECTOR; k++) B[k] = (double)s.B[7][k];
    solve(&s, &s.F[BETTER], E, 7, lights.known, better);
    check_close(report.lights.total_indirect.mean, figure(&s, 1, B, better, better, E), 2e-4);
    subject_free(&s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("judge");
    TCase *cases = tcase_create("judge");
    tcase_set_timeout(cases, 120);
    tcase_add_loop_test(cases, figures_are_those_of_dense_solutions, 0, 8);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
