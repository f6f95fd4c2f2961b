/* The limiter of answers against a slow one that adds up each node from its elements, and the properties that
 * it promises whatever the answer. */
#include "solver/base/random.h"
#include "solver/operator/limiter.h"
#include "support/dense.h"
#include "support/failing_memory.h"
#include "support/suite.h"

#include <float.h>
#include <math.h>
#include <omp.h>
#include <string.h>

static lam_error error;

enum { N = 1500, C = 2, GROUPS = 9, MANY = 19, ROW = C * N, LARGE = 70001 };

static const lam_quantity quantities[] = {LAM_RADIOSITY, LAM_IRRADIANCE, LAM_INDIRECT};

/* Groups whose elements stand apart in the mesh: one has all but a few, one has one, one has none. */
typedef struct subject {
    lam_operator *op;
    uint32_t start[GROUPS + 1], elements[N];
    double area[N];
    lam_limiter l;
    void *work;
    float *E, *H0, *out; /* [MANY][C][N] */
} subject;

static uint32_t group_of(size_t i, uint64_t *seed) {
    if (i == 77) return 3;
    const double at = random_lcg_unit(seed);
    return at < .7 ? 0 : at < .75 ? 1 : at < .8 ? 2 : 5 + (uint32_t)(4 * (at - .8) / .2001);
}

static lam_operator *any_operator(size_t n, size_t n_channels, uint64_t *seed) {
    lam_operator *op = NULL;
    float *rho = test_allocate(n_channels * n, sizeof *rho);
    float *U = test_allocate(n, sizeof *U), *V = test_allocate(n, sizeof *V);
    float *core = test_allocate(n_channels, sizeof *core);
    for (size_t k = 0; k < n_channels * n; k++)
        rho[k] = k % 11 == 0 ? 0 : (float)(.9 * random_lcg_unit(seed));
    for (size_t i = 0; i < n; i++) U[i] = V[i] = (float)random_lcg_unit(seed);
    ck_ok(operator_low_rank_create_factored(n, 1, n_channels, rho, U, V, core, &op, &error));
    free(rho);
    return op;
}

/* Answers whose reflected light is negative here and there; a vector of which v % 3 is 0 has large regions
 * below zero, 1 single elements, 2 none. */
static subject *make_subject(lam_quantity quantity) {
    subject *s = test_allocate(1, sizeof *s);
    uint64_t seed = 29;
    uint32_t group[N];
    allocations_left = -1;
    for (size_t i = 0; i < N; i++) {
        group[i] = group_of(i, &seed);
        s->area[i] = i % 97 == 0 ? 0 : .01 + random_lcg_unit(&seed);
        s->start[group[i] + 1]++;
    }
    for (size_t g = 0; g < GROUPS; g++) s->start[g + 1] += s->start[g];
    for (size_t g = 0, k = 0; g < GROUPS; g++)
        for (size_t i = 0; i < N; i++)
            if (group[i] == g) s->elements[k++] = (uint32_t)i;
    s->op = any_operator(N, C, &seed);
    s->l = limiter_of(N, GROUPS, s->start, s->elements, s->area);
    s->work = test_allocate(lam_limiter_work_bytes(&s->l), 1);
    s->E = test_allocate((size_t)MANY * ROW, sizeof *s->E);
    s->H0 = test_allocate((size_t)MANY * ROW, sizeof *s->H0);
    s->out = test_allocate((size_t)MANY * ROW, sizeof *s->out);
    for (size_t k = 0; k < (size_t)MANY * ROW; k++) {
        const size_t v = k / ROW, i = k % N;
        const double wave = v % 3 == 0 ? sin((double)(v + 3) * (double)i / 90) - .3 : 1;
        const double drop = v % 3 == 1 && random_lcg_unit(&seed) < .03 ? 4 : 0;
        const float P = (float)(wave + .8 * random_lcg_unit(&seed) - drop);
        s->E[k] = random_lcg_unit(&seed) < .1 ? (float)(5 * random_lcg_unit(&seed)) : 0;
        s->H0[k] = (float)random_lcg_unit(&seed);
        s->out[k] = operator_finish(
            quantity, s->op->reflectance[k % ROW],
            operator_light(s->op->reflectance + k % ROW - i, s->E + k - i, s->H0 + k - i, i), P, s->H0[k]);
    }
    return s;
}

static void free_subject(subject *s) {
    lam_operator_close(s->op);
    free(s->work);
    free(s->E);
    free(s->H0);
    free(s->out);
    free(s);
}

static double direct_of(const subject *s, lam_quantity quantity, size_t k) {
    const float *rho = s->op->reflectance + k % ROW;
    if (quantity == LAM_RADIOSITY) return (double)(s->E[k] + *rho * s->H0[k]);
    return quantity == LAM_IRRADIANCE ? (double)s->H0[k] : 0;
}

static double sum_of(size_t count, const double *area, const double *x) {
    double sum = 0;
    for (size_t e = 0; e < count; e++) sum += area[e] * x[e];
    return sum;
}

/* The rule of limiter.h as it stands there: x [count] are to have the sum `left`. */
static void limit_slowly(size_t count, const double *area, double *x, double left) {
    const size_t n_blocks = (count + LIMITER_BLOCK - 1) / LIMITER_BLOCK, cut = n_blocks / 2 * LIMITER_BLOCK;
    const double sum = sum_of(count, area, x);
    if (!(left > 0)) {
        memset(x, 0, count * sizeof *x);
        return;
    }
    if (n_blocks <= 1) {
        bool below = left != sum;
        for (size_t e = 0; e < count; e++) below = below || x[e] < 0;
        double low = 0, high = 0; /* of the level, by bisection */
        for (size_t e = 0; e < count; e++) high = fmax(high, x[e]);
        for (int step = 0; step < 200 && below; step++) {
            const double level = (low + high) / 2;
            double above = 0;
            for (size_t e = 0; e < count; e++) above += area[e] * fmax(x[e] - level, 0);
            *(above > left ? &low : &high) = level;
        }
        for (size_t e = 0; e < count && below; e++) x[e] = fmax(x[e] - low, 0);
        return;
    }
    const double first = sum_of(cut, area, x), second = sum_of(count - cut, area + cut, x + cut);
    const double to_first = first > 0 ? second > 0 ? left * (first / sum) : left : 0;
    limit_slowly(cut, area, x, to_first);
    limit_slowly(count - cut, area + cut, x + cut, left - to_first);
}

/* Group g of the row that begins at k: its areas and what it has beside direct light. */
static size_t group_values(const subject *s, lam_quantity quantity, const float *out, size_t k, size_t g,
                           double *area, double *x, double *magnitude) {
    const size_t count = s->start[g + 1] - s->start[g];
    *magnitude = 0;
    for (size_t e = 0; e < count; e++) {
        const size_t i = s->elements[s->start[g] + e];
        area[e] = s->area[i];
        x[e] = (double)out[k + i] - direct_of(s, quantity, k + i);
        *magnitude += area[e] * fmax(fabs((double)out[k + i]), direct_of(s, quantity, k + i));
    }
    return count;
}

static void limit(const subject *s, size_t n_rhs, lam_quantity quantity, float *out, size_t *limited) {
    ck_ok(lam_limiter_apply(&s->l, s->op, n_rhs, quantity, s->E, s->H0, NULL, out, limited, s->work,
                            lam_limiter_work_bytes(&s->l), &error));
}

/* Values are single precision: each is rounded once, by half an ulp of itself. The slow one subtracts sums
 * where the fast one scales these, so that both differ by a few roundings in double of the sum of magnitudes,
 * which reach an element in full where its block has a small area: 1e-9 is far above and below what matters.
 */
START_TEST(agrees_with_the_slow_one) {
    const lam_quantity quantity = quantities[_i];
    subject *s = make_subject(quantity);
    float *out = test_allocate((size_t)MANY * ROW, sizeof *out);
    double area[N], x[N], y[N], magnitude;
    size_t limited[MANY], changed = 0;
    memcpy(out, s->out, (size_t)MANY * ROW * sizeof *out);
    limit(s, MANY, quantity, out, limited);
    for (size_t v = 0; v < MANY; v++) {
        size_t negative = 0;
        for (size_t k = v * ROW; k < (v + 1) * ROW; k += N)
            for (size_t g = 0; g < GROUPS; g++) {
                const size_t count = group_values(s, quantity, s->out, k, g, area, x, &magnitude);
                bool below = false;
                for (size_t e = 0; e < count; e++) {
                    negative += x[e] < 0;
                    below = below || x[e] < 0;
                }
                if (below) limit_slowly(count, area, x, sum_of(count, area, x));
                for (size_t e = 0; e < count; e++) {
                    const size_t i = s->elements[s->start[g] + e];
                    const double truth = direct_of(s, quantity, k + i) + x[e], found = (double)out[k + i];
                    ck_assert_msg(fabs(found - truth) <= FLT_EPSILON / 2 * fabs(truth) * 1.0001 + 1e-9,
                                  "vector %zu, element %zu: %.9g instead of %.9g", v, i, found, truth);
                    changed += out[k + i] != s->out[k + i];
                }
                (void)group_values(s, quantity, out, k, g, area, y, &magnitude);
                ck_assert_msg(below || memcmp(x, y, count * sizeof *x) == 0, "group %zu changed", g);
            }
        ck_assert_uint_eq(limited[v], negative);
        ck_assert(v % 3 == 2 ? negative == 0 : negative > 0);
    }
    ck_assert_uint_gt(changed, 1000);
    free(out);
    free_subject(s);
}
END_TEST

START_TEST(keeps_means_and_leaves_nothing_below_zero) {
    const lam_quantity quantity = quantities[_i];
    subject *s = make_subject(quantity);
    float *out = test_allocate((size_t)MANY * ROW, sizeof *out);
    double area[N], x[N], y[N], magnitude;
    size_t kept = 0, dark = 0;
    memcpy(out, s->out, (size_t)MANY * ROW * sizeof *out);
    limit(s, MANY, quantity, out, NULL);
    for (size_t k = 0; k < (size_t)MANY * ROW; k += N)
        for (size_t g = 0; g < GROUPS; g++) {
            const size_t count = group_values(s, quantity, s->out, k, g, area, x, &magnitude);
            const double before = sum_of(count, area, x);
            (void)group_values(s, quantity, out, k, g, area, y, &magnitude);
            for (size_t e = 0; e < count; e++) ck_assert_double_ge(y[e], 0);
            /* Each value is rounded by half an ulp. */
            ck_assert_double_le(fabs(sum_of(count, area, y) - fmax(before, 0)),
                                FLT_EPSILON / 2 * 1.0001 * magnitude);
            kept += before > 0;
            dark += before < 0;
        }
    ck_assert_uint_gt(kept, 100);
    ck_assert_uint_gt(dark, 10);
    /* A second time changes nothing. */
    float *again = test_allocate((size_t)MANY * ROW, sizeof *again);
    size_t limited[MANY];
    memcpy(again, out, (size_t)MANY * ROW * sizeof *out);
    limit(s, MANY, quantity, again, limited);
    ck_assert_mem_eq(again, out, (size_t)MANY * ROW * sizeof *out);
    for (size_t v = 0; v < MANY; v++) ck_assert_uint_eq(limited[v], 0);
    free(again);
    free(out);
    free_subject(s);
}
END_TEST

START_TEST(gives_the_same_bits_alone_and_in_part) {
    const lam_quantity quantity = quantities[_i];
    subject *s = make_subject(quantity);
    const uint32_t asked[] = {s->elements[s->start[8]], s->elements[5], s->elements[s->start[3]],
                              s->elements[4]};
    uint32_t *whole = NULL;
    size_t n_whole = 0, all[MANY], one;
    float *out = test_allocate((size_t)MANY * ROW, sizeof *out), *alone = test_allocate(ROW, sizeof *alone);
    memcpy(out, s->out, (size_t)MANY * ROW * sizeof *out);
    limit(s, MANY, quantity, out, all);
    ck_ok(limiter_whole_groups(&s->l, 4, asked, &whole, &n_whole, &error));
    ck_assert_uint_eq(n_whole, s->start[1] + (s->start[9] - s->start[8]) + 1);
    for (size_t v = 0; v < MANY; v++) {
        const limiter_light light = {.E = s->E + v * ROW, .H0 = s->H0 + v * ROW};
        memcpy(alone, s->out + v * ROW, ROW * sizeof *alone);
        limiter_limit(&s->l, s->op, 1, quantity, &light, 0, NULL, alone, &one, s->work);
        ck_assert_mem_eq(alone, out + v * ROW, ROW * sizeof *alone);
        ck_assert_uint_eq(one, all[v]);
        for (size_t k = 0; k < C * n_whole; k++)
            alone[k] = s->out[v * ROW + k / n_whole * N + whole[k % n_whole]];
        limiter_limit(&s->l, s->op, 1, quantity, &light, n_whole, whole, alone, NULL, s->work);
        for (size_t k = 0; k < C * n_whole; k++)
            ck_assert(alone[k] == out[v * ROW + k / n_whole * N + whole[k % n_whole]]);
    }
    free(whole);
    free(out);
    free(alone);
    free_subject(s);
}
END_TEST

START_TEST(leaves_what_has_signs_and_what_is_not_finite) {
    subject *s = make_subject(LAM_RADIOSITY);
    float *out = test_allocate(ROW, sizeof *out);
    size_t limited;
    memcpy(out, s->out, ROW * sizeof *out);
    s->E[1] = -1e-30f;
    limit(s, 1, LAM_RADIOSITY, out, &limited);
    ck_assert_mem_eq(out, s->out, N * sizeof *out); /* the first channel alone has signs */
    ck_assert(memcmp(out + N, s->out + N, N * sizeof *out) != 0);
    s->E[1] = 0;
    s->H0[N + 1] = -1;
    memcpy(out, s->out, ROW * sizeof *out);
    limit(s, 1, LAM_RADIOSITY, out, &limited);
    ck_assert(memcmp(out, s->out, N * sizeof *out) != 0);
    ck_assert_mem_eq(out + N, s->out + N, N * sizeof *out);
    s->H0[N + 1] = 0;
    memcpy(out, s->out, ROW * sizeof *out);
    out[s->elements[3]] = -INFINITY;
    limit(s, 1, LAM_RADIOSITY, out, &limited);
    ck_assert(isinf(out[s->elements[3]]));
    free(out);
    free_subject(s);
}
END_TEST

/* A group that several threads share. */
START_TEST(does_not_depend_on_threads) {
    uint64_t seed = 5;
    lam_operator *op = any_operator(LARGE, 1, &seed);
    uint32_t *elements = test_allocate(LARGE, sizeof *elements);
    const uint32_t start[] = {0, LARGE};
    double *area = test_allocate(LARGE, sizeof *area);
    float *E = test_allocate(LARGE, sizeof *E), *out = test_allocate(2 * (size_t)LARGE, sizeof *out);
    for (size_t i = 0; i < LARGE; i++) {
        elements[i] = (uint32_t)i;
        area[i] = random_lcg_unit(&seed);
        out[i] = out[LARGE + i] = (float)(sin((double)i / 300) + random_lcg_unit(&seed));
    }
    const lam_limiter l = limiter_of(LARGE, 1, start, elements, area);
    void *work = test_allocate(lam_limiter_work_bytes(&l), 1);
    for (size_t t = 0; t < 2; t++) {
        size_t limited;
        lam_operator_set_threads(op, 1 + 3 * t);
        omp_set_num_threads(4);
        limiter_limit(&l, op, 1, LAM_INDIRECT, &(limiter_light){.E = E}, 0, NULL, out + t * LARGE, &limited,
                      work);
        ck_assert_uint_gt(limited, LARGE / 10);
    }
    ck_assert_mem_eq(out, out + LARGE, LARGE * sizeof *out);
    free(work);
    free(out);
    free(E);
    free(area);
    free(elements);
    lam_operator_close(op);
}
END_TEST

START_TEST(refuses_in_one_line) {
    subject *s = make_subject(LAM_INDIRECT);
    uint64_t seed = 3;
    lam_operator *other = any_operator(N + 1, C, &seed);
    const size_t bytes = lam_limiter_work_bytes(&s->l);
    ck_assert(lam_limiter_apply(&s->l, other, 1, LAM_INDIRECT, s->E, NULL, NULL, s->out, NULL, s->work, bytes,
                                &error) == LAM_ERR_ARGUMENT);
    ck_assert_str_eq(error.message,
                     "an operator of 1501 elements and a limiter of 1500 are not of one store");
    ck_assert(lam_limiter_apply(&s->l, s->op, 1, LAM_INDIRECT, s->E, NULL, NULL, s->out, NULL, s->work, 7,
                                &error) == LAM_ERR_ARGUMENT);
    ck_assert(lam_limiter_apply(&s->l, s->op, 1, (lam_quantity)9, s->E, NULL, NULL, s->out, NULL, s->work,
                                bytes, &error) == LAM_ERR_ARGUMENT);
    ck_assert(lam_limiter_apply(&s->l, s->op, 1, LAM_INDIRECT, NULL, NULL, s->E, s->out, NULL, s->work, bytes,
                                &error) == LAM_ERR_ARGUMENT);
    ck_assert(lam_limiter_open("/nowhere", NULL, &error) == LAM_ERR_ARGUMENT);
    uint32_t *whole = NULL;
    size_t count = 0;
    for (int left = 0; left < 2; left++) {
        allocations_left = left;
        ck_assert(limiter_whole_groups(&s->l, 1, s->elements, &whole, &count, &error) == LAM_ERR_MEMORY);
    }
    allocations_left = -1;
    ck_assert(whole == NULL && count == 0);
    lam_operator_close(other);
    free_subject(s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("limiter");
    TCase *cases = tcase_create("limiter");
    tcase_add_loop_test(cases, agrees_with_the_slow_one, 0, 3);
    tcase_add_loop_test(cases, keeps_means_and_leaves_nothing_below_zero, 0, 3);
    tcase_add_loop_test(cases, gives_the_same_bits_alone_and_in_part, 0, 3);
    tcase_add_test(cases, leaves_what_has_signs_and_what_is_not_finite);
    tcase_add_test(cases, does_not_depend_on_threads);
    tcase_add_test(cases, refuses_in_one_line);
    suite_add_tcase(suite, cases);
    return suite_run_together(suite);
}
