/* The figures of the judge against those of dense solutions, element by element: of an operator that is off,
 * with two channels, against two samples that are twins or not, with first light that is known and its
 * spread. And what they say of an operator whose error is known, by noisy references. */
#include "solver/base/random.h"
#include "solver/method/judge/judge_figures.h"
#include "solver/method/judge/judge_probes.h"
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

/* Half the difference of two estimates of that light. */
static double spread_of(size_t e, size_t i) {
    return i == e ? 0 : .001 * (double)((3 * i + e) % 5);
}

/* The converged B of E [C][n]; the light of the bright element e itself is first_of, and a share of its
 * spread, where that is known. */
static void solve(const subject *s, const csr *F, const double *E, size_t e, bool known, double share,
                  double *B) {
    lam_error error = {.message = ""};
    for (size_t c = 0; c < C; c++) {
        const float *rho = s->rho + c * N;
        double emitted[N], light[N];
        reference *r = NULL;
        csr_multiply_rows(F, 0, N, 1, E + c * N, light);
        for (size_t i = 0; i < N; i++)
            emitted[i] = E[c * N + i] +
                         (known ? (double)rho[i] *
                                      (E[c * N + e] * (first_of(e, i) + share * spread_of(e, i)) - light[i])
                                : 0);
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
        solve(s, &s->F[OWN], E, e, false, 0, B);
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
/* Single elements of a round, and those that the noise is measured by where the other reference is coarser.
 */
enum { ROUND = 16, NOISE_SINGLES = 7 };

/* An answer of one probe, and what is known of its error. */
typedef struct answer {
    double E[VECTOR], B[VECTOR], off[VECTOR], noise[VECTOR], apart[VECTOR];
    double noise2[VECTOR]; /* independent parts of the noise, squared */
} answer;

/* Figures of all so far, with the noise or without it: their sum, the largest one, noise by element. */
typedef struct expected_sums {
    double f, most, noise[N];
} expected_sums;

typedef struct expected {
    expected_sums plain, less;
    double most_bound, coarse, coarse_plain;
    size_t count;
} expected;

/* The squared figure where the noise of element i is larger by a step. */
static double squared_figure(const subject *s, const answer *a, size_t i, double step, bool indirect) {
    double error = 0, light = 0;
    for (size_t k = 0; k < VECTOR; k++) {
        const double moved = a->off[k] + (k % N == i ? step * a->noise[k] : 0);
        const double d = a->B[k] + moved - (indirect ? a->E[k] : 0);
        error += s->m.area[k % N] * moved * moved;
        light += s->m.area[k % N] * d * d;
    }
    return error / light;
}

/* Its derivative by the noise of element i, found by moving that a little, but that the whole figure is
 * f2 where it multiplies the light: (x - f2 d) t. */
static double slope_at(const subject *s, const answer *a, size_t i, double f2, bool indirect) {
    const double step = 1e-5, all = squared_figure(s, a, i, 0, indirect);
    double light = 0, by_light = 0;
    for (size_t k = 0; k < VECTOR; k++) {
        const double d = a->B[k] + a->off[k] - (indirect ? a->E[k] : 0);
        light += s->m.area[k % N] * d * d;
        if (k % N == i) by_light += 2 * s->m.area[i] * d * a->noise[k];
    }
    return (squared_figure(s, a, i, step, indirect) - squared_figure(s, a, i, -step, indirect)) / (2 * step) +
           (all - f2) * by_light / light;
}

/* Adds sqrt(f2); returns its noise. */
static double add_expected(const subject *s, const answer *a, double f2, bool indirect, expected_sums *to) {
    double slope[N], sigma2 = 0;
    for (size_t i = 0; i < N; i++) {
        slope[i] = slope_at(s, a, i, f2, indirect);
        sigma2 += slope[i] * slope[i];
    }
    const double sigma = sqrt(sigma2), f = sqrt(f2);
    const double off = fmax(sqrt(f2 + sigma) - f, f - sqrt(fmax(0, f2 - sigma)));
    to->f += f;
    to->most = fmax(to->most, f);
    for (size_t i = 0; i < N && sigma > 0; i++) to->noise[i] += slope[i] * off / sigma;
    return off;
}

static void add_answer(const subject *s, const answer *a, bool indirect, expected *to) {
    const double f2 = squared_figure(s, a, 0, 0, indirect);
    double noise2 = 0, light = 0, apart = 0;
    for (size_t k = 0; k < VECTOR; k++) {
        const double d = a->B[k] + a->off[k] - (indirect ? a->E[k] : 0);
        light += s->m.area[k % N] * d * d;
        noise2 += s->m.area[k % N] * a->noise2[k];
        apart += s->m.area[k % N] * a->apart[k] * a->apart[k];
    }
    const double off = add_expected(s, a, f2, indirect, &to->plain);
    (void)add_expected(s, a, fmax(0, f2 - noise2 / light), indirect, &to->less);
    to->most_bound = fmax(to->most_bound, sqrt(f2) + 2 * hypot(off, sqrt(apart / light)));
    to->coarse += sqrt(apart / light);
    to->coarse_plain += apart > 0 ? sqrt(f2) : 0;
    to->count++;
}

/* Expectations of the light of some elements: against the operator's own F, and against the others. */
typedef struct expectations {
    expected own, relative, indirect;
} expectations;

/* Twins have independent estimates of the first light, a disturbed reference one that is as noisy. */
static double share_of(reference_relation relation, size_t sample) {
    if (relation == REFERENCE_TWIN) return sample == BETTER ? 1 : -1;
    return relation == REFERENCE_DISTURBED && sample == OTHER ? 1 : 0;
}

/* coarse: the coarser reference is known. */
static void add_one(const subject *s, size_t e, double strength, bool known, reference_relation relation,
                    bool coarse, expectations *to) {
    double x[SAMPLES][VECTOR];
    answer own = {.E = {0}}, all;
    for (size_t c = 0; c < C; c++) own.E[c * N + e] = strength;
    for (size_t k = 0; k < VECTOR; k++) own.B[k] = strength * (double)s->B[e][k];
    for (size_t f = 0; f < SAMPLES; f++) {
        solve(s, &s->F[f], own.E, e, known && f != OWN, share_of(relation, f), x[f]);
        for (size_t k = 0; k < VECTOR; k++) x[f][k] -= own.B[k];
    }
    all = own;
    for (size_t k = 0; k < VECTOR; k++) {
        const double better = x[BETTER][k], other = x[OTHER][k];
        own.off[k] = x[OWN][k];
        all.off[k] = relation == REFERENCE_TWIN ? .5 * (better + other) : better;
        if (relation == REFERENCE_TWIN) all.noise[k] = .5 * (better - other);
        if (relation == REFERENCE_DISTURBED) all.noise[k] = other - better;
        if (relation == REFERENCE_COARSER && coarse) all.apart[k] = other_share * (better - other);
        const double light =
            known && relation == REFERENCE_COARSER ? (double)s->rho[k] * strength * spread_of(e, k % N) : 0;
        all.noise2[k] = all.noise[k] * all.noise[k] + light * light;
        all.noise[k] += light;
    }
    add_answer(s, &own, true, &to->own);
    add_answer(s, &all, true, &to->indirect);
    add_answer(s, &all, false, &to->relative);
}

static void check_close(double found, double wanted, double share) {
    ck_assert_double_gt(wanted, 0);
    ck_assert_double_eq_tol(found, wanted, share * wanted);
}

/* single: all elements are probes, and each pair of them has its noise twice. */
static double noise_of(const expected *of, bool bound, bool single) {
    double sum = 0;
    const expected_sums *sums = bound ? &of->plain : &of->less;
    for (size_t i = 0; i < N; i++) sum += sums->noise[i] * sums->noise[i] * (single ? 2 : 1);
    const double coarse = of->coarse_plain > 0 ? of->coarse / of->coarse_plain * of->plain.f : 0;
    return sqrt(sum + coarse * coarse) / (double)of->count;
}

static void check_figures(const error_figures *found, const expected *of, bool bound, bool single,
                          double share) {
    const double count = (double)of->count;
    const double mean = bound ? of->plain.f / count + 2 * noise_of(of, true, single) : of->less.f / count;
    check_close(found->mean, mean, share);
    check_close(found->max, bound ? fmax(mean, of->most_bound) : of->less.most, share);
}

/* A group's noise and its figures. */
static void check_group(const error_group *g, const expectations *of, bool single, double share,
                        double share_of_noise) {
    const double noise = noise_of(&of->indirect, false, single);
    ck_assert_int_eq(g->is_bound, noise > of->indirect.less.f / (double)of->indirect.count / 3);
    if (noise > 0)
        check_close(g->reference_noise, noise_of(&of->indirect, g->is_bound, single), share_of_noise);
    else
        ck_assert(g->reference_noise == 0);
    /* Twice the noise is a part of bounds. */
    const double of_figures = g->is_bound ? share_of_noise : share;
    check_figures(&g->total_indirect, &of->indirect, g->is_bound, single, of_figures);
    check_figures(&g->total_relative, &of->relative, g->is_bound, single, of_figures);
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
    const bool as_rows = _i & 2;
    const reference_relation relation = (reference_relation)(_i / 4);
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
                               .relation = relation,
                               .other_share = other_share,
                               .first_light = known_light,
                               .first_light_context = &lights,
                               .probes = N,
                               .seed = 5};
    ck_ok(judge_operator(s.op, &input, &report, &error));
    expectations sum = {.own = {.count = 0}}, lamp = {.own = {.count = 0}};
    double own = 0;
    ck_assert_uint_eq(lights.order[0], 7);
    for (size_t v = 0; v < N; v++) {
        add_one(&s, lights.order[v + 1], 1, lights.known, relation, v < n_coarse, &sum);
        if (v + 1 == n_operator) own = sum.own.plain.f / (double)n_operator;
    }
    ck_assert_uint_eq(report.single.probes, N);
    ck_assert_uint_eq(report.single.operator_probes, n_operator);
    check_close(report.single.operator_indirect.mean, own, share);
    check_group(&report.single, &sum, true, share, share_of_noise);
    ck_assert(report.single.probes_noise == 0);
    /* The scene's own light is that of element 7. */
    add_one(&s, 7, 2, lights.known, relation, true, &lamp);
    check_group(&report.lights, &lamp, false, share, share_of_noise);
    ck_assert(report.lights.probes_noise == 0);
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
                               .relation = REFERENCE_TWIN,
                               .probes = N,
                               .seed = 5};
    ck_ok(judge_operator(s.op, &input, &report, &error));
    expected all = {0};
    for (size_t e = 0; e < N; e++) {
        answer one = {.E = {0}};
        light_up(e, one.E);
        solve(&s, &exact, one.E, e, false, 0, one.off);
        for (size_t k = 0; k < VECTOR; k++) {
            one.B[k] = (double)s.B[e][k];
            one.off[k] -= one.B[k];
        }
        add_answer(&s, &one, true, &all);
    }
    *truth = all.plain.f / N;
    *stated = report.single;
    csr_free(&exact);
    subject_free(&s);
}

/* References of 24 seeds, with noise of up to 2, 10 or 60 % in each exchange area. A wall whose form factors
 * are 2 % too large for the operator is noticed: its answers agree with its own form factors better than with
 * the others. The standard error of 24 is known to 1 / sqrt(48), or 15 %. The stated one may be off by a
 * factor of 2: it takes the noise of elements for independent, while that of rows that are not closed is not.
 * A bound is an upper one unless the noise is twice as large as it says: of 24 seeds one or none. */
START_TEST(stated_errors_are_true_within_their_noise) {
    enum { SEEDS = 24 };
    static const double offs[] = {.02, .1, .6};
    const double off = offs[_i], scale = 1.02;
    double square = 0, noise2 = 0, mean = 0, own = 0, truth = 0;
    size_t bounds = 0, above = 0;
    for (uint64_t seed = 1; seed <= SEEDS; seed++) {
        error_group stated;
        state(off, scale, seed, &stated, &truth);
        const double away = stated.total_indirect.mean - truth;
        ck_assert_double_gt(stated.total_indirect.mean, stated.reference_noise);
        ck_assert_double_ge(stated.total_indirect.max, stated.total_indirect.mean);
        if (stated.is_bound) {
            bounds++;
            above += away >= 0;
            ck_assert_double_ge(stated.total_indirect.mean, 2 * stated.reference_noise);
        }
        square += away * away / SEEDS;
        noise2 += stated.reference_noise * stated.reference_noise / SEEDS;
        mean += stated.total_indirect.mean / SEEDS;
        own = stated.operator_indirect.mean;
    }
    ck_assert_uint_ge(above + (bounds + 23) / 24, bounds);
    ck_assert(_i == 0 ? bounds == 0 : _i == 1 || bounds > SEEDS / 2);
    if (_i > 0) return;
    ck_assert_double_le(square, 4 * noise2);
    ck_assert_double_le(noise2, 4 * square);
    /* Of the mean of 24 the standard error is a fifth of that of one. */
    ck_assert_double_le(fabs(mean - truth), 3 * sqrt(square / SEEDS));
    ck_assert_double_gt(mean, own + sqrt(noise2));
}
END_TEST

/* Figures of 1, 2, 3 and 4: of endless many probes the mean has sqrt(5/3 / 4). */
START_TEST(the_choice_of_probes_has_a_standard_error) {
    const figure_tally four = {.tried = 4, .count = 4, .plain = {.f = 10, .f2 = 30}},
                       one = {.tried = 1, .count = 1, .plain = {.f = 2, .f2 = 4}},
                       unlit = {.tried = 8, .count = 4, .plain = {.f = 10, .f2 = 30}};
    ck_assert_double_eq_tol(figures_spread(&four, 0), sqrt(5. / 12), 1e-12);
    ck_assert_double_eq_tol(figures_spread(&four, 16), sqrt(5. / 12 * .75), 1e-12);
    ck_assert_double_eq_tol(figures_spread(&unlit, 16), sqrt(5. / 12 * .5), 1e-12);
    ck_assert(figures_spread(&four, 4) == 0);
    ck_assert(figures_spread(&one, 1) == 0);
    ck_assert(figures_spread(&one, 16) < 0);
}
END_TEST

/* With sources each of them is one of the single elements, random emission is theirs alone, and so is the
 * scene's own light: of which there is none, as element 7 is no source. */
START_TEST(sources_alone_emit) {
    static const size_t sources[] = {2, 9, 11};
    enum { SOURCES = sizeof sources / sizeof sources[0] };
    lighting lights = {.known = false};
    float emits[N] = {0};
    subject s;
    error_report report;
    lam_error error = {.message = ""};
    subject_make(&s);
    for (size_t k = 0; k < SOURCES; k++) emits[sources[k]] = 1;
    const build_problem problem = {
        .n = N, .n_channels = C, .area = s.m.area, .reflectance = s.rho, .F = &s.F[OWN]};
    judge_input input = {.problem = &problem,
                         .row_sums = s.row_sums,
                         .emission = s.emission,
                         .emits = emits,
                         .own = product_of(&s.F[OWN], true),
                         .independent = product_of(&s.F[BETTER], true),
                         .other = product_of(&s.F[OTHER], true),
                         .relation = REFERENCE_DISTURBED,
                         .first_light = known_light,
                         .first_light_context = &lights,
                         .probes = N,
                         .seed = 5};
    ck_ok(judge_operator(s.op, &input, &report, &error));
    expectations sum = {.own = {.count = 0}};
    for (size_t k = 0; k < SOURCES; k++) add_one(&s, sources[k], 1, false, REFERENCE_DISTURBED, true, &sum);
    ck_assert_uint_eq(report.single.probes, SOURCES);
    ck_assert(report.single.probes_noise == 0);
    check_close(report.single.operator_indirect.mean, sum.own.plain.f / SOURCES, 2e-4);
    /* Three of all elements are probes, and have the noise of light between them twice. */
    const double twice = sqrt(1 + (double)SOURCES / N);
    check_close(report.single.reference_noise, twice * noise_of(&sum.indirect, report.single.is_bound, false),
                2e-3);
    ck_assert_uint_eq(report.lights.probes, 0);
    ck_assert_uint_gt(report.random.probes, 0);
    emits[7] = 1;
    lights.count = 0;
    ck_ok(judge_operator(s.op, &input, &report, &error));
    ck_assert_uint_eq(report.lights.probes, 1);
    ck_assert_uint_eq(report.single.probes, SOURCES + 1);
    /* The emissions themselves. */
    probe_source source;
    probes p;
    for (size_t k = 0; k < VECTOR; k++) s.emission[k] = 3;
    ck_ok(probe_source_make(&problem, s.op, s.emission, emits, N, 4, 5, &source, &error));
    ck_assert_uint_eq(source.most[JUDGE_SINGLE], SOURCES + 1);
    ck_ok(probes_next(&source, (size_t[]){4, 0, 1, SOURCES + 1}, false, &p, &error));
    for (size_t v = 0; v < p.m; v++)
        for (size_t k = 0; k < VECTOR; k++) {
            const float E = p.E[v * VECTOR + k];
            if (emits[k % N] == 0) ck_assert_float_eq(E, 0);
            if (emits[k % N] > 0 && v < p.begin[JUDGE_SINGLE]) ck_assert_float_gt(E, 0);
        }
    probes_free(&p);
    probe_source_free(&source);
    subject_free(&s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("judge");
    TCase *cases = tcase_create("judge");
    tcase_set_timeout(cases, 120);
    tcase_add_loop_test(cases, figures_are_those_of_dense_solutions, 0, 12);
    tcase_add_loop_test(cases, stated_errors_are_true_within_their_noise, 0, 3);
    tcase_add_test(cases, the_choice_of_probes_has_a_standard_error);
    tcase_add_test(cases, sources_alone_emit);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
