/* The errors of receivers: sums over probes, channels and elements, written out. */
#include "solver/method/judge/judge_figures.h"
#include "support/dense.h"
#include "support/suite.h"

#include <math.h>

enum { N = 6, C = 2, VECTOR = C * N, PROBES = 3 };

static const double area[N] = {1, 2, .5, 1.5, 3, 1};
static const float read_by[N] = {1, 0, .25f, 0, 1, 0};
static const float rho[VECTOR] = {.5f, .5f, .5f, .5f, .5f, .5f, .2f, .2f, .2f, .2f, .2f, .2f};

/* Made-up answers and corrections. */
typedef struct probe_numbers {
    float E[VECTOR], B[VECTOR];
    double x[VECTOR], y[VECTOR];
} probe_numbers;

static void numbers_make(size_t v, double off, double noise, probe_numbers *p) {
    for (size_t k = 0; k < VECTOR; k++) {
        p->E[k] = k % N == v ? 1 : 0;
        p->B[k] = p->E[k] + .1f + .02f * (float)((k + v) % 5);
        p->x[k] = off * (1 + .1 * (double)((k * 3 + v) % 4));
        p->y[k] = p->x[k] + noise * ((k + v) % 2 == 0 ? 1 : -1);
    }
}

static figure_probe probe_of(const build_problem *problem, const probe_numbers *p,
                             reference_relation relation) {
    return (figure_probe){.problem = problem,
                          .E = p->E,
                          .B = p->B,
                          .x = p->x,
                          .y = p->y,
                          .relation = relation,
                          .other_share = .5};
}

/* Checks the sums of all probes, with the noise taken out where it is small, else within a bound. */
static void check(reference_relation relation, double off, double noise, bool bound) {
    const build_problem problem = {.n = N, .n_channels = C, .area = area, .reflectance = rho};
    receiver_sums total = {.b = 0}, own = {.b = 0};
    double b = 0, d = 0, wrong = 0, power = 0;
    for (size_t v = 0; v < PROBES; v++) {
        probe_numbers p;
        numbers_make(v, off, noise, &p);
        const figure_probe one = probe_of(&problem, &p, relation);
        receivers_add(&one, read_by, &total);
        receivers_add(&one, read_by, &own);
        for (size_t k = 0; k < VECTOR; k++) {
            const double w = area[k % N] * (double)read_by[k % N];
            const bool twin = relation == REFERENCE_TWIN;
            const double e = twin ? (p.x[k] + p.y[k]) / 2 : p.x[k], B = (double)p.B[k] + e;
            const double t =
                twin ? (p.x[k] - p.y[k]) / 2 : (relation == REFERENCE_COARSER ? .5 : 1) * (p.y[k] - p.x[k]);
            b += w * B * B;
            d += w * (B - (double)p.E[k]) * (B - (double)p.E[k]);
            wrong += w * e * e;
            power += w * t * t;
        }
    }
    const receiver_figures f = receivers_of(&total, &own);
    const double without = relation == REFERENCE_COARSER ? wrong : fmax(wrong - power, 0);
    const double stated = bound ? sqrt(wrong) + sqrt(power) : sqrt(without);
    ck_assert(f.known);
    ck_assert_int_eq(f.is_bound, bound);
    ck_assert_double_eq_tol(f.noise, sqrt(power / d), 1e-12);
    ck_assert_double_eq_tol(f.total_indirect, stated / sqrt(d), 1e-12);
    ck_assert_double_eq_tol(f.total_relative, stated / sqrt(b), 1e-12);
    ck_assert_double_eq_tol(f.operator_indirect, sqrt(wrong / d), 1e-12);
}

START_TEST(errors_are_sums_over_what_is_read) {
    static const reference_relation relations[] = {REFERENCE_TWIN, REFERENCE_DISTURBED, REFERENCE_COARSER};
    check(relations[_i], .01, .001, false);
    check(relations[_i], .01, .05, true);
    check(relations[_i], 0, .01, true);
}
END_TEST

/* Receivers that nothing lights have no error; all elements count where these are not known. */
START_TEST(dark_receivers_have_no_figures) {
    const build_problem problem = {.n = N, .n_channels = C, .area = area, .reflectance = rho};
    receiver_sums sums = {.b = 0};
    probe_numbers p;
    error_group g = {.total_indirect = {.mean = .5}, .operator_indirect = {.mean = .25}};
    numbers_make(0, 0, 0, &p);
    for (size_t k = 0; k < VECTOR; k++) p.B[k] = p.E[k];
    const figure_probe one = probe_of(&problem, &p, REFERENCE_TWIN);
    receivers_add(&one, read_by, &sums);
    g.receivers = receivers_of(&sums, &sums);
    ck_assert(!g.receivers.known);
    ck_assert_double_eq(judge_total(&g), .5);
    ck_assert_double_eq(judge_of_operator(&g), .25);
    g.receivers = (receiver_figures){.known = true, .total_indirect = .1, .operator_indirect = .05};
    ck_assert_double_eq(judge_total(&g), .1);
    ck_assert_double_eq(judge_of_operator(&g), .05);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("judge receivers");
    TCase *cases = tcase_create("judge receivers");
    tcase_add_loop_test(cases, errors_are_sums_over_what_is_read, 0, 3);
    tcase_add_test(cases, dark_receivers_have_no_figures);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
