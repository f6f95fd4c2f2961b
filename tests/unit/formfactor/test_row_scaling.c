/* Scales of rows: found by extrapolated sweeps where plain ones would be a thousand. */
#include "solver/base/random.h"
#include "solver/formfactor/row_scaling.h"
#include "support/dense.h"
#include "support/suite.h"

#include <math.h>
#include <stdlib.h>

static lam_error error;

/* Elements in a ring of groups, g_ij = s_i s_j C_kl / (elements of a group) for i in group k and j in l: C
 * has `own` in its diagonal and (1 - own) / 2 beside it, so that its rows sum to 1 and d = 1 / s. */
enum { GROUPS = 6, OF_GROUP = 1500, N = GROUPS * OF_GROUP };
typedef struct ring {
    double own, *s; /* [N] */
} ring;

static lam_status ring_sums(void *context, const double *d, double *r, lam_error *e) {
    const ring *of = context;
    double light[GROUPS] = {0};
    (void)e;
    for (size_t i = 0; i < N; i++) light[i / OF_GROUP] += of->s[i] * d[i] / OF_GROUP;
    for (size_t i = 0; i < N; i++) {
        const size_t k = i / OF_GROUP, next = (k + 1) % GROUPS, last = (k + GROUPS - 1) % GROUPS;
        r[i] = d[i] * of->s[i] * (of->own * light[k] + .5 * (1 - of->own) * (light[next] + light[last]));
    }
    return LAM_OK;
}

/* C has the eigenvalues own + (1 - own) cos(k pi / 3), four of them, so that a linear problem would be solved
 * by five steps. The lowest, 2 own - 1, is that of facing plates: a sweep leaves 1 - own of its error. */
START_TEST(few_products_do) {
    static const double owns[] = {.3, .01};
    ring of = {.own = owns[_i], .s = test_allocate(N, sizeof *of.s)};
    double *area = test_allocate(N, sizeof *area), *d = test_allocate(N, sizeof *d);
    double *r = test_allocate(N, sizeof *r), *before = test_allocate(N, sizeof *before);
    uint64_t seed = 3;
    for (size_t i = 0; i < N; i++) {
        of.s[i] = exp((random_unit(&seed) - .5) * (i / OF_GROUP % 2 == 0 ? 1 : .3));
        area[i] = 1;
    }
    row_scaling c = {
        .n = N, .area = area, .sums = ring_sums, .context = &of, .sweeps_most = 4000, .d = d, .r = r};
    ck_ok(row_scaling_settle(&c, before, &error));
    ck_assert_double_le(c.worst, 2e-8);
    /* An error x of log d moves log r by at least 2 own x, so that 2e-8 of r is 1e-8 / own of d. */
    for (size_t i = 0; i < N; i++) ck_assert_double_le(fabs(d[i] * of.s[i] - 1), 1.1e-8 / of.own);
    ck_assert_uint_le(c.products, 20);
    free(of.s);
    free(area);
    free(d);
    free(r);
    free(before);
}
END_TEST

/* The ring, with sums that are off by 1e-6 at most, in another way for each d: no steps close all rows. */
typedef struct rough_ring {
    ring of;
    double least; /* of the worst rows so far */
} rough_ring;

static lam_status rough_sums(void *context, const double *d, double *r, lam_error *e) {
    rough_ring *of = context;
    double worst = 0;
    ring_sums(&of->of, d, r, e);
    for (size_t i = 0; i < N; i++) {
        r[i] *= 1 + 1e-6 * sin(1e9 * log(d[i]));
        worst = fmax(worst, fabs(r[i] - 1));
    }
    of->least = fmin(of->least, worst);
    return LAM_OK;
}

/* The best of the steps stays, and no thousands of sweeps follow. */
START_TEST(the_best_step_stays) {
    rough_ring of = {.of = {.own = .3, .s = test_allocate(N, sizeof *of.of.s)}, .least = INFINITY};
    double *area = test_allocate(N, sizeof *area), *d = test_allocate(N, sizeof *d);
    double *r = test_allocate(N, sizeof *r), *before = test_allocate(N, sizeof *before);
    uint64_t seed = 3;
    for (size_t i = 0; i < N; i++) {
        of.of.s[i] = exp(random_unit(&seed) - .5);
        area[i] = 1;
    }
    row_scaling c = {
        .n = N, .area = area, .sums = rough_sums, .context = &of, .sweeps_most = 4000, .d = d, .r = r};
    ck_ok(row_scaling_settle(&c, before, &error));
    ck_assert_double_gt(c.worst, 2e-8);
    ck_assert_double_le(c.worst, 4e-6);
    ck_assert_double_eq(c.worst, of.least);
    ck_assert_uint_le(c.products, 62);
    for (size_t i = 0; i < N; i++) ck_assert_double_le(fabs(d[i] * of.of.s[i] - 1), 1e-5);
    free(of.of.s);
    free(area);
    free(d);
    free(r);
    free(before);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("row scaling");
    TCase *cases = tcase_create("row scaling");
    tcase_add_loop_test(cases, few_products_do, 0, 2);
    tcase_add_test(cases, the_best_step_stays);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
