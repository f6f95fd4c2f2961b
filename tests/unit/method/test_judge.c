/* The figures of the judge against those of dense solutions, element by element: of an operator that is off,
 * with two channels, against two samples that are twins or not, with first light that is known and its
 * spread. And what they say of an operator whose error is known, by noisy references. */
#include "solver/base/random.h"
#include "solver/method/judge.h"
#include "solver/method/reference.h"
#include "support/box.h"
#include "support/suite.h"

#include "store/status.h"

enum { SIDE = 2, N = 6 * SIDE * SIDE, C = 2, VECTOR = C * N };
enum { OWN, BETTER, OTHER, SAMPLES };

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

/* The exact operator of its own sample, rounded to three digits. */
static void make_operator(subject *s) {
    lam_error error = {.message = ""};
    float *P = malloc(C * N * N * sizeof *P);
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

static void subject_make(subject *s) {
    static const double off[SAMPLES] = {.02, .1, .15};
    s->m = box_mesh(size, SIDE, .5f);
    for (size_t k = 0; k < SAMPLES; k++) s->F[k] = disturbed(&s->m, off[k], k);
    for (size_t i = 0; i < VECTOR; i++) {
        s->rho[i] = i < N ? .3f + .02f * (float)(i % 5) : .6f - .01f * (float)(i % 4);
        s->emission[i] = i % N == 7 ? 2 : 0;
    }
    for (size_t i = 0; i < N; i++) s->row_sums[i] = 1;
    make_operator(s);
}

static void subject_free(subject *s) {
    lam_operator_close(s->op);
    for (size_t k = 0; k < SAMPLES; k++) csr_free(&s->F[k]);
    mesh_free(&s->m);
}

/* Half the difference of two estimates of that light. */
static double spread_of(size_t e, size_t i) {
    return i == e ? 0 : .001 * (double)((3 * i + e) % 5);
}

/* A flag for known first light, and the elements in the order of the probes, the lights first. */
typedef struct lighting {
    bool known;
    size_t order[N + 1], count;
} lighting;

static lam_status known_light(void *context, const float *E, double *H, double *D, bool *known,
                              lam_error *error) {
    lighting *l = context;
    size_t count = 0, e = 0;
    (void)error;
    for (size_t i = 0; i < N; i++)
        if (E[i] > 0) count++, e = i;
    ck_assert_uint_le(l->count, N);
    l->order[l->count++] = e;
    *known = l->known && count == 1;
    for (size_t i = 0; *known && i < N; i++) {
        H[i] = (double)E[e] * first_of(e, i);
        D[i] = (double)E[e] * spread_of(e, i);
    }
    return LAM_OK;
}

static const double other_share = .4;
/* Single elements of a round, and those that the noise is measured by where the samples are no twins. */
enum { ROUND = 16, NOISE_SINGLES = 3 };

/* Sums of an answer by the corrections x and y of two samples. */
typedef struct sums {
    double indirect, error, noise, variance, coarse;
} sums;

static sums sums_of(const subject *s, size_t e, bool known, bool twins, const double *E, const double *B,
                    const double *x, const double *y) {
    sums out = {0};
    for (size_t i = 0; i < N; i++) {
        const double a = s->m.area[i];
        double product = 0;
        for (size_t k = i; k < VECTOR; k += N) {
            const double off = twins ? .5 * (x[k] + y[k]) : x[k], apart = twins ? .5 * (x[k] - y[k]) : 0;
            const double light = known ? (double)s->rho[k] * E[k - i + e] * spread_of(e, i) : 0;
            const double noise2 = apart * apart + light * light, bounced = B[k] + off - E[k];
            out.indirect += a * bounced * bounced;
            out.error += a * off * off;
            out.noise += a * noise2;
            out.coarse += twins ? 0 : a * pow(other_share * (x[k] - y[k]), 2);
            product += a * fabs(off) * sqrt(noise2);
        }
        out.variance += 4 * product * product;
    }
    return out;
}

/* Of the light of some elements, over the indirect light: errors, their squares, those of the noise, its
 * variance and the distance to the coarser sample. */
typedef struct expected {
    double own, total, largest, error2, noise2, variance, coarse2;
} expected;

static void add_one(const subject *s, size_t e, double strength, bool known, bool twins, expected *to) {
    double E[VECTOR] = {0}, B[VECTOR], x[SAMPLES][VECTOR];
    for (size_t c = 0; c < C; c++) E[c * N + e] = strength;
    for (size_t k = 0; k < VECTOR; k++) B[k] = strength * (double)s->B[e][k];
    for (size_t f = 0; f < SAMPLES; f++) {
        solve(s, &s->F[f], E, e, known && f != OWN, x[f]);
        for (size_t k = 0; k < VECTOR; k++) x[f][k] -= B[k];
    }
    const sums own = sums_of(s, e, false, false, E, B, x[OWN], x[OWN]);
    const sums all = sums_of(s, e, known, twins, E, B, x[BETTER], x[OTHER]);
    to->own += sqrt(own.error / own.indirect);
    to->total += sqrt(all.error / all.indirect);
    to->largest = fmax(to->largest, sqrt(all.error / all.indirect));
    to->error2 += all.error / all.indirect;
    to->noise2 += all.noise / all.indirect;
    to->variance += all.variance / (all.indirect * all.indirect);
    to->coarse2 += all.coarse / all.indirect;
}

static void check_close(double found, double wanted, double share) {
    ck_assert_double_gt(wanted, 1e-3);
    ck_assert_double_eq_tol(found, wanted, share * wanted);
}

/* A group's noise and its figures of `count` elements, of which the coarser sample is known for n_coarse. */
static void check_group(const error_group *g, const expected *of, double coarse2, double count, double share,
                        double share_of_noise) {
    const double less = fmax(0, of->error2 - of->noise2) / count;
    const double off = sqrt(of->variance / count);
    const double left = fmax(sqrt(less + off) - sqrt(less), sqrt(less) - sqrt(fmax(0, less - off)));
    const double noise = sqrt(left * left + coarse2), scale = sqrt(count * less / of->error2);
    if (noise > 0)
        check_close(g->reference_noise, noise, share_of_noise);
    else
        ck_assert(g->reference_noise == 0);
    ck_assert_int_eq(g->is_bound, noise > scale * of->total / count / 3);
    check_close(g->total_indirect.mean, (g->is_bound ? 1 : scale) * of->total / count, share);
    check_close(g->total_indirect.max, (g->is_bound ? 1 : scale) * of->largest, share);
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
    const bool twins = _i & 2, as_rows = _i & 4;
    /* An LU solves to rounding; P and B are in single precision. Guided corrections are found to .002 of
     * themselves; the distance of two, which the noise consists of, is a third of one of them at least. */
    const double share = as_rows ? 2e-4 : 4e-3, share_of_noise = as_rows ? 2e-3 : 4e-2;
    const size_t n_operator = as_rows ? N : ROUND, n_coarse = as_rows ? N : NOISE_SINGLES;
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
                               .other = product_of(&s.F[OTHER], as_rows),
                               .twins = twins,
                               .other_share = other_share,
                               .first_light = known_light,
                               .first_light_context = &lights,
                               .probes = N,
                               .seed = 5};
    ck_ok(judge_operator(s.op, &input, &report, &error));
    expected sum = {0}, lamp = {0};
    double own = 0, coarse2 = 0;
    ck_assert_uint_eq(lights.order[0], 7);
    for (size_t v = 0; v < N; v++) {
        add_one(&s, lights.order[v + 1], 1, lights.known, twins, &sum);
        if (v + 1 == n_operator) own = sum.own / (double)n_operator;
        if (v + 1 == n_coarse) coarse2 = sum.coarse2 / (double)n_coarse;
    }
    ck_assert_uint_eq(report.single.probes, N);
    ck_assert_uint_eq(report.single.operator_probes, n_operator);
    check_close(report.single.operator_indirect.mean, own, share);
    check_group(&report.single, &sum, coarse2, N, share, share_of_noise);
    /* The scene's own light is that of element 7. */
    add_one(&s, 7, 2, lights.known, twins, &lamp);
    check_group(&report.lights, &lamp, lamp.coarse2, 1, share, share_of_noise);
    subject_free(&s);
}
END_TEST

/* F of the box with independent noise of up to this share in each exchange area; rows of wall 0 scaled. */
static csr noisy(const mesh *m, double off, uint64_t seed, double scale) {
    csr F = box_form_factors(size, SIDE, m->area);
    for (size_t i = 0; i < N; i++)
        for (uint64_t p = F.indptr[i]; p < F.indptr[i + 1]; p++) {
            const size_t j = F.indices[p], low = i < j ? i : j, high = i < j ? j : i;
            const double unit = random_to_double(random_hash(seed * N * N + low * N + high));
            const bool scaled = i < SIDE * SIDE || j < SIDE * SIDE;
            F.data[p] *= (float)((1 + off * (2 * unit - 1)) * (scaled ? scale : 1));
        }
    return F;
}

/* Stated errors of all single elements by twins of this noise, and the true ones, of an operator whose own
 * form factors have one wall that is too bright by `scale`. */
static void state(double off, double scale, uint64_t seed, error_group *stated, double *truth) {
    subject s;
    error_report report;
    lam_error error = {.message = ""};
    csr exact;
    subject_make(&s);
    exact = box_form_factors(size, SIDE, s.m.area);
    lam_operator_close(s.op);
    for (size_t k = 0; k < SAMPLES; k++) csr_free(&s.F[k]);
    for (size_t k = 0; k < SAMPLES; k++)
        s.F[k] = noisy(&s.m, k == OWN ? 0 : off, seed * SAMPLES + k, k == OWN ? scale : 1);
    make_operator(&s);
    const build_problem problem = {
        .n = N, .n_channels = C, .area = s.m.area, .reflectance = s.rho, .F = &s.F[OWN]};
    const judge_input input = {.problem = &problem,
                               .row_sums = s.row_sums,
                               .emission = s.emission,
                               .own = factor_product_of_rows(&s.F[OWN]),
                               .independent = factor_product_of_rows(&s.F[BETTER]),
                               .other = factor_product_of_rows(&s.F[OTHER]),
                               .twins = true,
                               .probes = N,
                               .seed = 5};
    ck_ok(judge_operator(s.op, &input, &report, &error));
    *truth = 0;
    for (size_t e = 0; e < N; e++) {
        double E[VECTOR], B[VECTOR], x[VECTOR];
        light_up(e, E);
        for (size_t k = 0; k < VECTOR; k++) B[k] = (double)s.B[e][k];
        solve(&s, &exact, E, e, false, x);
        for (size_t k = 0; k < VECTOR; k++) x[k] -= B[k];
        const sums all = sums_of(&s, e, false, false, E, B, x, x);
        *truth += sqrt(all.error / all.indirect) / N;
    }
    *stated = report.single;
    csr_free(&exact);
    subject_free(&s);
}

/* References of 16 seeds, with noise of up to 2 or 10 % in each exchange area. A wall whose form factors are
 * 2 % too large for the operator is noticed: its answers agree with its own form factors better than with the
 * others. */
START_TEST(stated_errors_are_true_within_their_noise) {
    enum { SEEDS = 16 };
    const double off = _i == 0 ? .02 : .1, scale = 1.02;
    double square = 0, noise2 = 0, mean = 0, own = 0, truth = 0;
    for (uint64_t seed = 1; seed <= SEEDS; seed++) {
        error_group stated;
        state(off, scale, seed, &stated, &truth);
        const double away = stated.total_indirect.mean - truth;
        if (stated.is_bound)
            ck_assert_double_ge(away, 0);
        else
            ck_assert_double_le(fabs(away), 3 * stated.reference_noise);
        if (_i == 0) ck_assert(!stated.is_bound);
        square += away * away / SEEDS;
        noise2 += stated.reference_noise * stated.reference_noise / SEEDS;
        mean += stated.total_indirect.mean / SEEDS;
        own = stated.operator_indirect.mean;
    }
    ck_assert_double_le(square, noise2);
    if (_i > 0) return;
    /* Of the mean of 16 the standard error is a quarter of that of one. */
    ck_assert_double_le(fabs(mean - truth), 3 * sqrt(square / SEEDS));
    ck_assert_double_gt(mean, own + sqrt(noise2));
}
END_TEST

int main(void) {
    Suite *suite = suite_create("judge");
    TCase *cases = tcase_create("judge");
    tcase_set_timeout(cases, 120);
    tcase_add_loop_test(cases, figures_are_those_of_dense_solutions, 0, 8);
    tcase_add_loop_test(cases, stated_errors_are_true_within_their_noise, 0, 2);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
