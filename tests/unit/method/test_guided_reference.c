/* Corrections with a guide: as near as an operator is, of no use, of no use for one probe, with some probes
 * that speak for others, in two channels, cancelled. */
#include "solver/method/judge/guided_reference.h"
#include "support/box.h"
#include "support/suite.h"

#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 5, N = 6 * SIDE * SIDE, M = 3, C = 2, VECTOR = C * N };

static const double size[3] = {10, 6, 3};

typedef struct subject {
    mesh m;
    csr F;
    float rho[VECTOR];
    double r[M * VECTOR], exact[M * VECTOR], X[M * VECTOR];
    reference *dense[C];
    factor_product product;
    reference_system system;
    size_t columns; /* multiplied by F so far */
} subject;

/* A guide: the true answer with an error of its own. */
typedef struct teacher {
    const subject *s;
    double off;  /* of the answer, relative */
    bool misled; /* the second of all M probes gets nonsense */
    int calls;
} teacher;

static lam_status teach(void *context, size_t m, const double *r, double *X, lam_error *error) {
    lam_status status = LAM_OK;
    teacher *t = context;
    t->calls++;
    for (size_t k = 0; k < m * C; k++)
        TRY(reference_solve(t->s->dense[k % C], 1, r + k * N, X + k * N, 0, NULL, error));
    for (size_t k = 0; k < m * VECTOR; k++) X[k] = (1 + t->off * (k % 2 == 0 ? 1 : -1)) * X[k];
    for (size_t i = VECTOR; t->misled && m == M && i < (size_t)2 * VECTOR; i++) X[i] *= -30;
done:
    return status;
}

static lam_status multiply(const void *context, size_t m, const double *x, double *y, lam_error *error) {
    subject *s = (subject *)(uintptr_t)context;
    (void)error;
    s->columns += m;
    csr_multiply_rows(&s->F, 0, N, m, x, y);
    return LAM_OK;
}

static void subject_make(subject *s) {
    lam_error error = {.message = ""};
    s->columns = 0;
    s->m = box_mesh(size, SIDE, .5f);
    s->F = box_form_factors(size, SIDE, s->m.area);
    for (size_t i = 0; i < VECTOR; i++) s->rho[i] = (i < N ? .2f : .4f) + .4f * (float)(i % 7) / 7;
    for (size_t k = 0; k < M * VECTOR; k++)
        s->r[k] = k % VECTOR == 11 * (k / VECTOR) ? 1 : .01 * ((double)(k % 5) - 2);
    s->product = (factor_product){.n = N, .multiply = multiply, .context = s};
    s->system = (reference_system){N, C, &s->product, s->m.area, s->rho, NULL};
    for (size_t c = 0; c < C; c++)
        ck_ok(reference_create(&s->F, s->m.area, s->rho + c * N, REFERENCE_DENSE, &s->dense[c], &error));
    for (size_t k = 0; k < M * C; k++)
        ck_ok(reference_solve(s->dense[k % C], 1, s->r + k * N, s->exact + k * N, 0, NULL, &error));
}

static void subject_free(subject *s) {
    for (size_t c = 0; c < C; c++) reference_destroy(s->dense[c]);
    csr_free(&s->F);
    mesh_free(&s->m);
}

/* |X - x| / |x| of a probe, by area. */
static double distance(const subject *s, size_t probe) {
    double off = 0, all = 0;
    for (size_t k = probe * VECTOR; k < (probe + 1) * VECTOR; k++) {
        off += s->m.area[k % N] * (s->X[k] - s->exact[k]) * (s->X[k] - s->exact[k]);
        all += s->m.area[k % N] * s->exact[k] * s->exact[k];
    }
    return sqrt(off / all);
}

/* Steps of an error q leave q^k after k of them: the last one that is taken knows that the next is not
 * needed. One product with F comes between two steps. */
START_TEST(a_good_guide_needs_few_steps) {
    lam_error error = {.message = ""};
    static const struct {
        double off, tolerance;
        int calls;
    } cases[] = {{.03, 1e-7, 5}, {.001, 1e-7, 3}, {.001, 1e-4, 2}, {.03, 1e-2, 2}};
    subject s;
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        subject_make(&s);
        teacher t = {.s = &s, .off = cases[c].off};
        const reference_guide guide = {teach, &t};
        ck_ok(
            guided_reference_correct(&s.system, M, s.r, s.X, cases[c].tolerance, &guide, NULL, NULL, &error));
        for (size_t v = 0; v < M; v++) ck_assert_double_le(distance(&s, v), 1.5 * cases[c].tolerance);
        ck_assert_int_eq(t.calls, cases[c].calls);
        ck_assert_uint_eq(s.columns, (size_t)(M * C * (t.calls - 1)));
        subject_free(&s);
    }
}
END_TEST

/* Where steps do not shrink, the iteration goes on without the guide. */
START_TEST(a_bad_guide_does_no_harm) {
    lam_error error = {.message = ""};
    subject s;
    for (int k = 0; k < 2; k++) {
        subject_make(&s);
        teacher t = {.s = &s, .off = k == 0 ? .9 : 30};
        const reference_guide guide = {teach, &t};
        ck_ok(guided_reference_correct(&s.system, M, s.r, s.X, 1e-7, &guide, NULL, NULL, &error));
        for (size_t v = 0; v < M; v++) ck_assert_double_lt(distance(&s, v), 1e-5);
        ck_assert_int_lt(t.calls, 5);
        subject_free(&s);
    }
}
END_TEST

/* One probe that the guide misleads does not keep it from the others. */
START_TEST(each_probe_goes_its_own_way) {
    lam_error error = {.message = ""};
    subject s;
    subject_make(&s);
    teacher t = {.s = &s, .off = .01, .misled = true};
    const reference_guide guide = {teach, &t};
    ck_ok(guided_reference_correct(&s.system, M, s.r, s.X, 2e-8, &guide, NULL, NULL, &error));
    for (size_t v = 0; v < M; v++) ck_assert_double_lt(distance(&s, v), v == 1 ? 1e-6 : 4e-8);
    ck_assert_int_eq(t.calls, 4);
    subject_free(&s);
}
END_TEST

START_TEST(nothing_lacking_needs_no_product) {
    lam_error error = {.message = ""};
    subject s;
    subject_make(&s);
    memset(s.r, 0, sizeof s.r);
    teacher t = {.s = &s};
    const reference_guide guide = {teach, &t};
    ck_ok(guided_reference_correct(&s.system, M, s.r, s.X, 1e-8, &guide, NULL, NULL, &error));
    for (size_t k = 0; k < M * VECTOR; k++) ck_assert_double_eq(s.X[k], 0);
    ck_assert_uint_eq(s.columns, 0);
    subject_free(&s);
}
END_TEST

/* More probes than there are pilots, and their exact corrections. */
enum { MANY = 12, PILOTS = 8 };

typedef struct many {
    subject s;
    double r[MANY * VECTOR], exact[MANY * VECTOR], X[MANY * VECTOR];
} many;

static void many_make(many *t) {
    lam_error error = {.message = ""};
    subject_make(&t->s);
    for (size_t k = 0; k < MANY * VECTOR; k++)
        t->r[k] = k % VECTOR == 7 * (k / VECTOR) ? 1 : .01 * ((double)(k % 5) - 2);
    for (size_t k = 0; k < MANY * C; k++)
        ck_ok(reference_solve(t->s.dense[k % C], 1, t->r + k * N, t->exact + k * N, 0, NULL, &error));
}

/* The largest |X - x| / |x| of probes first ... last - 1. */
static double many_distance(many *t, size_t first, size_t last) {
    double most = 0;
    for (size_t v = first; v < last; v++) {
        memcpy(t->s.X, t->X + v * VECTOR, VECTOR * sizeof *t->X);
        memcpy(t->s.exact, t->exact + v * VECTOR, VECTOR * sizeof *t->exact);
        const double d = distance(&t->s, 0);
        most = d > most ? d : most;
    }
    return most;
}

/* A guide that is off by .001 leaves .001 to .002 (the error of M r - x is .001 x, of alternating sign) after
 * one step; the pilots show it, and have 1e-6 or so after their second one. With that rate no product is
 * needed any more. */
START_TEST(pilots_speak_for_the_others) {
    lam_error error = {.message = ""};
    many *t = calloc(1, sizeof *t);
    double rate = 0, again[MANY * VECTOR];
    ck_assert_ptr_nonnull(t);
    many_make(t);
    memcpy(again, t->r, sizeof again);
    teacher of = {.s = &t->s, .off = .001};
    const reference_guide guide = {teach, &of};
    ck_ok(guided_reference_correct(&t->s.system, MANY, t->r, t->X, 2e-3, &guide, &rate, NULL, &error));
    ck_assert_uint_eq(t->s.columns, PILOTS * C);
    ck_assert_double_gt(rate, 1e-4);
    ck_assert_double_lt(rate, 5e-3);
    ck_assert_double_lt(many_distance(t, 0, PILOTS), 1e-5);
    ck_assert_double_lt(many_distance(t, PILOTS, MANY), 5e-3);
    ck_assert_double_gt(many_distance(t, PILOTS, MANY), 5e-4);
    const double known = rate;
    ck_ok(guided_reference_correct(&t->s.system, MANY, again, t->X, 2e-3, &guide, &rate, NULL, &error));
    ck_assert_uint_eq(t->s.columns, PILOTS * C);
    ck_assert_double_eq(rate, known);
    ck_assert_double_lt(many_distance(t, 0, MANY), 5e-3);
    subject_free(&t->s);
    free(t);
}
END_TEST

/* Pilots whose steps shrink by less, or of which the guide misleads one, speak for nobody: all probes
 * converge as far as without them. */
START_TEST(pilots_may_find_a_guide_too_bad) {
    lam_error error = {.message = ""};
    for (int k = 0; k < 3; k++) {
        many *t = calloc(1, sizeof *t);
        double rate = 0;
        ck_assert_ptr_nonnull(t);
        many_make(t);
        teacher of = {.s = &t->s, .off = k == 0 ? .03 : k == 1 ? .9 : .001};
        const reference_guide guide = {teach, &of};
        ck_ok(guided_reference_correct(&t->s.system, MANY, t->r, t->X, 1e-4, &guide, k < 2 ? &rate : NULL,
                                       NULL, &error));
        ck_assert_double_lt(many_distance(t, 0, MANY), 1.5e-4);
        if (k < 2) ck_assert_double_gt(rate, 5e-3);
        if (k == 2) ck_assert_uint_ge(t->s.columns, MANY * C);
        subject_free(&t->s);
        free(t);
    }
}
END_TEST

enum { MEAN_PROBES = 11 };
static const double mean_rho = .6, mean_excess = 1.03;

/* Each sees all others alike: F x = mean x. */
static lam_status multiply_by_mean(const void *context, size_t m, const double *x, double *y,
                                   lam_error *error) {
    const size_t n = *(const size_t *)context;
    (void)error;
    for (size_t k = 0; k < m; k++) {
        double sum = 0;
        for (size_t i = 0; i < n; i++) sum += x[i * m + k];
        for (size_t i = 0; i < n; i++) y[i * m + k] = sum / (double)n;
    }
    return LAM_OK;
}

/* Corrections [MEAN_PROBES] that were visited, of which all elements have the same, and how often. */
typedef struct visits {
    size_t n;
    double x[MEAN_PROBES];
    int count[MEAN_PROBES];
} visits;

static void see(void *context, size_t v, size_t channel, const double *x) {
    visits *all = context;
    ck_assert_uint_eq(channel, 0);
    ck_assert_uint_lt(v, MEAN_PROBES);
    for (size_t i = 1; i < all->n; i += 1001) ck_assert_double_eq_tol(x[i], x[0], 1e-4 * fabs(x[0]));
    all->x[v] = x[0];
    all->count[v]++;
}

/* Of many elements probes come in smaller batches, and the operator answers them one by one. Its answers
 * B = E + 1.03 rho / (1 - rho) mean E lack -.03 of the light that bounces. */
START_TEST(many_elements_are_corrected_alike) {
    lam_error error = {.message = ""};
    const size_t n = REFERENCE_MANY_ELEMENTS;
    float *E = calloc(MEAN_PROBES * n, sizeof *E), *B = calloc(MEAN_PROBES * n, sizeof *B);
    float *rho = calloc(n, sizeof *rho), *Y = calloc(n, sizeof *Y), *V = calloc(n, sizeof *V);
    double *area = calloc(n, sizeof *area);
    size_t which[MEAN_PROBES];
    visits seen = {.n = n};
    lam_operator *op = NULL;
    ck_assert(E != NULL && B != NULL && rho != NULL && Y != NULL && V != NULL && area != NULL);
    const double bounced = mean_rho / (1 - mean_rho);
    for (size_t i = 0; i < n; i++) {
        area[i] = 1;
        rho[i] = (float)mean_rho;
        Y[i] = (float)(-mean_excess * bounced / (double)n);
        V[i] = 1;
    }
    for (size_t v = 0; v < MEAN_PROBES; v++) {
        which[v] = v;
        for (size_t i = v; i < n; i += 64) E[v * n + i] = (float)(v + 1);
    }
    ck_ok(operator_low_rank_create_folded(n, 1, rho, Y, V, &op, &error));
    const size_t bytes = lam_operator_work_bytes(op, MEAN_PROBES);
    void *work = malloc(bytes);
    ck_assert_ptr_nonnull(work);
    ck_ok(lam_operator_apply(op, MEAN_PROBES, LAM_RADIOSITY, E, B, work, bytes, &error));
    const factor_product F = {.n = n, .multiply = multiply_by_mean, .context = &n};
    const reference_system system = {n, 1, &F, area, rho, NULL};
    const reference_answers answers = {.op = op, .E = E, .B = B};
    ck_assert_uint_lt(guided_reference_columns(n, 1), MEAN_PROBES);
    ck_ok(guided_reference_each(&system, &answers, MEAN_PROBES, which, see, &seen, &error));
    for (size_t v = 0; v < MEAN_PROBES; v++) {
        const double wanted = (1 - mean_excess) * bounced * (double)(v + 1) / 64;
        ck_assert_int_eq(seen.count[v], 1);
        ck_assert_double_eq_tol(seen.x[v], wanted, 5e-3 * fabs(wanted));
    }
    lam_operator_close(op);
    free(work);
    free(E);
    free(B);
    free(rho);
    free(area);
}
END_TEST

static bool stop_at_once(void *context) {
    (void)context;
    return true;
}

static lam_status refuse(void *context, size_t m, const double *r, double *X, lam_error *error) {
    (void)context, (void)m, (void)r, (void)X;
    return status_fail(error, LAM_ERR_NUMERIC, "no answer");
}

START_TEST(errors_pass_through) {
    lam_error error = {.message = ""};
    const progress cancelled = {.cancelled = stop_at_once};
    const reference_guide guide = {refuse, NULL};
    subject s;
    subject_make(&s);
    ck_assert_int_eq(guided_reference_correct(&s.system, M, s.r, s.X, 1e-7, &guide, NULL, NULL, &error),
                     LAM_ERR_NUMERIC);
    ck_assert_str_eq(error.message, "no answer");
    ck_assert_int_eq(guided_reference_correct(&s.system, M, s.r, s.X, 1e-7, &guide, NULL, &cancelled, &error),
                     LAM_ERR_CANCELLED);
    subject_free(&s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("guided reference");
    TCase *cases = tcase_create("guided reference");
    tcase_add_test(cases, a_good_guide_needs_few_steps);
    tcase_add_test(cases, a_bad_guide_does_no_harm);
    tcase_add_test(cases, each_probe_goes_its_own_way);
    tcase_add_test(cases, pilots_speak_for_the_others);
    tcase_add_test(cases, pilots_may_find_a_guide_too_bad);
    tcase_add_test(cases, nothing_lacking_needs_no_product);
    tcase_add_test(cases, many_elements_are_corrected_alike);
    tcase_add_test(cases, errors_pass_through);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
