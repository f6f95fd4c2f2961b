/* The limiter on answers of every kind: no light below zero, the means of groups kept, the same bits in part.
 */
#include "solver/operator/limiter.h"
#include "support/suite.h"
#include "support/transport.h"

enum { N_RHS = 19, GROUPS = 3, LIGHTS = 4 };

static const lam_quantity quantities[] = {LAM_RADIOSITY, LAM_IRRADIANCE, LAM_INDIRECT};

static lam_error error;

/* Groups that are mixed in the mesh, and areas of all sizes. */
typedef struct grouping {
    uint32_t *start, *elements;
    double *area;
    lam_limiter l;
} grouping;

static grouping make_groups(size_t n) {
    grouping g = {.start = test_allocate(GROUPS + 1, sizeof *g.start)};
    size_t count = 0;
    g.elements = test_allocate(n, sizeof *g.elements);
    g.area = test_allocate(n, sizeof *g.area);
    for (size_t k = 0; k < GROUPS; k++) {
        for (size_t i = 0; i < n; i++)
            if ((i * 7 / 5) % GROUPS == k) g.elements[count++] = (uint32_t)i;
        g.start[k + 1] = (uint32_t)count;
    }
    for (size_t i = 0; i < n; i++) g.area[i] = 1 / (1. + (double)(i % 17));
    g.l = limiter_of(n, GROUPS, g.start, g.elements, g.area);
    return g;
}

static void free_groups(grouping *g) {
    free(g->start);
    free(g->elements);
    free(g->area);
}

/* Light of a few elements, which leaves others dark: there a kind errs below zero. */
static float *lights(const transport *t) {
    const size_t size = t->n * t->n_channels;
    float *E = test_allocate(N_RHS * size, sizeof *E);
    for (size_t v = 0; v < N_RHS; v++)
        for (size_t k = 0; k < LIGHTS; k++)
            for (size_t c = 0; c < t->n_channels; c++)
                E[v * size + c * t->n + (v * 37 + k * k * 5) % t->n] = (float)(k + c + 1);
    return E;
}

/* The sum of A x of a group in a row, x being what is beside direct light, none of it negative; and what
 * rounding makes of it, half an ulp of each value, here three times that. */
static double group_sum(const transport *t, const grouping *g, size_t k, lam_quantity quantity,
                        const float *E, const float *H0, const float *rho, const float *out,
                        double *rounding) {
    double sum = 0;
    *rounding = 0;
    for (size_t e = g->start[k]; e < g->start[k + 1]; e++) {
        const size_t i = g->elements[e];
        const double direct = quantity == LAM_RADIOSITY    ? (double)operator_light(rho, E, H0, i)
                              : quantity == LAM_IRRADIANCE ? (double)H0[i]
                                                           : 0;
        ck_assert_msg((double)out[i] >= direct, "%s: element %zu is below zero", t->name, i);
        sum += g->area[i] * ((double)out[i] - direct);
        *rounding += 3 * TRANSPORT_U * g->area[i] * fmax(fabs((double)out[i]), direct);
    }
    return sum;
}

START_TEST(no_light_is_below_zero_and_means_stay) {
    const transport *t = transport_kept(_i);
    const size_t n = t->n, C = t->n_channels, size = n * C;
    grouping g = make_groups(n);
    float *E = lights(t), *H0 = random_vectors(N_RHS * size, 3),
          *out = test_allocate(N_RHS * size, sizeof *out);
    float *linear = test_allocate(N_RHS * size, sizeof *linear),
          *some = test_allocate(N_RHS * size, sizeof *some);
    const size_t bytes = lam_operator_work_bytes(t->op, N_RHS), limiting = lam_limiter_work_bytes(&g.l);
    void *work = test_allocate(bytes > limiting ? bytes : limiting, 1);
    size_t limited[N_RHS];
    for (size_t k = 0; k < N_RHS * size; k++) H0[k] = k / size % 2 == 0 ? fabsf(H0[k]) : 0;
    for (int q = 0; q < 3; q++) {
        ck_ok(lam_operator_apply_lit(t->op, N_RHS, quantities[q], E, H0, linear, work, bytes, &error));
        memcpy(out, linear, N_RHS * size * sizeof *out);
        /* Without such a value the test would try nothing. */
        const size_t dark = g.elements[g.start[1] + 2];
        out[dark] = linear[dark] = (quantities[q] == LAM_INDIRECT ? 0 : -10) - .25f;
        ck_ok(lam_limiter_apply(&g.l, t->op, N_RHS, quantities[q], E, H0, NULL, out, limited, work, limiting,
                                &error));
        ck_assert_uint_gt(limited[0], 0);
        for (size_t row = 0; row < N_RHS * C; row++)
            for (size_t k = 0; k < GROUPS; k++) {
                const float *rho = t->reflectance + row % C * n, *E_row = E + row * n, *H0_row = H0 + row * n;
                double rounding, before = 0;
                for (size_t e = g.start[k]; e < g.start[k + 1]; e++) {
                    const size_t i = g.elements[e];
                    const float direct = quantities[q] == LAM_RADIOSITY
                                             ? operator_light(rho, E_row, H0_row, i)
                                         : quantities[q] == LAM_IRRADIANCE ? H0_row[i]
                                                                           : 0;
                    before += g.area[i] * ((double)linear[row * n + i] - (double)direct);
                }
                const double after =
                    group_sum(t, &g, k, quantities[q], E_row, H0_row, rho, out + row * n, &rounding);
                ck_assert_msg(fabs(after - fmax(before, 0)) <= rounding, "%s: group %zu has %g instead of %g",
                              t->name, k, after, before);
            }
        /* Two groups alone, from the rows of their elements; the value above is no answer of the kind. */
        const uint32_t *two = g.elements + g.start[1];
        const size_t n_two = n - g.start[1], first = size, rows = (N_RHS - 1) * C;
        ck_ok(lam_operator_apply_selected(t->op, N_RHS - 1, quantities[q], E + first, H0 + first, n_two, two,
                                          some, work, bytes, &error));
        limiter_limit(&g.l, t->op, N_RHS - 1, quantities[q],
                      &(limiter_light){.E = E + first, .H0 = H0 + first}, n_two, two, some, NULL, work);
        for (size_t row = 0; row < rows; row++)
            for (size_t r = 0; r < n_two; r++)
                ck_assert(some[row * n_two + r] == out[first + row * n + two[r]]);
    }
    free(E);
    free(H0);
    free(out);
    free(linear);
    free(some);
    free(work);
    free_groups(&g);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("operator limits");
    TCase *tests = tcase_create("every kind");
    tcase_set_timeout(tests, 300);
    tcase_add_unchecked_fixture(tests, transport_keep_all, transport_free_all);
    tcase_add_loop_test(tests, no_light_is_below_zero_and_means_stay, 0, TRANSPORTS);
    suite_add_tcase(suite, tests);
    return suite_run_together(suite);
}
