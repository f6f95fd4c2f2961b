/* HF against a dense SVD in double: its bound, how its levels share it, and what it foresees. */
#include "solver/base/random.h"
#include "solver/method/low_rank/gram.h"
#include "solver/method/low_rank/hf.h"
#include "solver/method/norm.h"
#include "support/subject.h"
#include "support/transport.h"

#include <omp.h>

START_TEST(shares_fill_the_budget) {
    const double alphas[] = {.1, .5, .9}, ratios[] = {.5, 1, 4};
    for (int a = 0; a < 3; a++)
        for (int r = 0; r < 3; r++)
            for (int levels = 0; levels <= 8; levels++) {
                budget b = {.alpha = alphas[a]};
                budget_divide(&b, levels, ratios[r], levels % 3 * .3);
                double p[BUDGET_LEVELS_MOST + 1], sum = 0;
                budget_share(&b, .1, levels, p);
                for (int l = 0; l <= levels; l++) sum += ldexp(p[l] * p[l], l);
                ck_assert_double_eq_tol(sum, .01, 1e-12); /* sum_l 2^l p_l^2 = epsilon^2 */
                if (levels > 0) ck_assert_double_eq_tol(p[0] * p[0], alphas[a] * .01, 1e-12);
            }
}
END_TEST

START_TEST(hf_keeps_its_bound) {
    subject s;
    lam_error error = {0};
    subject_make(&s, room, 5); /* 150 elements, areas differ from face to face */
    const double epsilons[] = {.3, .1, .01, 1e-4}, alphas[] = {.1, .5, .9};
    for (int e = 0; e < 4; e++)
        for (int a = 0; a < 3; a++)
            for (int levels = 0; levels <= 4; levels++) {
                factorizer_options options = {
                    .epsilon = epsilons[e], .budget = {.alpha = alphas[a]}, .levels = levels};
                budget_divide(&options.budget, levels, levels % 2 ? .5 : 2, 0);
                if (levels > 1 && a != 1) { /* a level without nodes: four are joined at once */
                    options.budget.part[levels] += options.budget.part[1];
                    options.budget.part[1] = 0;
                }
                factorizer_report report;
                tall_factors f = factors_of(&s, "hf", &options, &report);
                double *values = values_of_difference(&s.S, &f), lanczos;
                const double norm = values[0];
                /* Rounding of the factors: 1e-6 of |S| = 1. */
                ck_assert_msg(norm <= epsilons[e] + 2e-6, "epsilon %g, alpha %g, %d levels: error %g",
                              epsilons[e], alphas[a], levels, norm);
                ck_assert_int_eq(norm_of_error(&s.S, &f, NULL, &lanczos, &error), LAM_OK);
                ck_assert_msg(lanczos <= values[0] * 1.0001 + 1e-7 && lanczos >= .97 * values[0] - 1e-6,
                              "norm %g, found %g", values[0], lanczos);
                check_orthonormal(&f);
                ck_assert_int_eq(report.levels, levels);
                ck_assert_double_eq(report.passes, 1);
                tall_factors_free(&f);
                free(values);
            }
    subject_free(&s);
}
END_TEST

/* The error of a node is orthogonal to that of its parent: with all of a level's error in one place the
 * bound of squares is nearly reached, and that of sums is far. */
START_TEST(errors_add_in_squares) {
    subject s;
    subject_make(&s, unit_cube, 5);
    for (int levels = 1; levels <= 3; levels++) {
        factorizer_options options = {.epsilon = .2, .budget = {.alpha = .5}, .levels = levels};
        budget_divide(&options.budget, levels, 1, 0);
        tall_factors f = factors_of(&s, "hf", &options, NULL);
        const double norm = norm_of_difference(&s.S, &f);
        double p[BUDGET_LEVELS_MOST + 1], sum = 0;
        budget_share(&options.budget, options.epsilon, levels, p);
        for (int l = 0; l <= levels; l++) sum += p[l] * pow(2, .5 * l);
        ck_assert_double_le(norm, .2 + 2e-6);
        ck_assert_double_gt(sum, .2 * 1.3); /* which eq. 3.10 would not allow */
        ck_assert_double_gt(norm, .3 * .2); /* it is used */
        tall_factors_free(&f);
    }
    subject_free(&s);
}
END_TEST

/* The rank at a bound is not far above the best there is. */
START_TEST(hf_rank_is_near_the_best) {
    subject s;
    subject_make(&s, unit_cube, 6);
    double *values = values_of_difference(&s.S, NULL);
    const factorizer_options options = {.epsilon = .1, .budget = {.alpha = .5}, .levels = -1};
    tall_factors f = factors_of(&s, "hf", &options, NULL);
    /* The root keeps every singular value above sqrt(.5) .1, which cannot be more than S has above that less
     * what was cut before (Weyl), and up to 63 more above half of it. */
    size_t most = 0;
    while (most < s.S.n && values[most] >= sqrt(.5) * .1) most++;
    ck_assert_uint_le(f.rank, most + 63);
    ck_assert_double_le(norm_of_difference(&s.S, &f), .1);
    tall_factors_free(&f);
    free(values);
    subject_free(&s);
}
END_TEST

START_TEST(bits_do_not_depend_on_threads) {
    subject s;
    subject_make(&s, room, 6);
    const int before = omp_get_max_threads();
    factorizer_options options = {.epsilon = .05, .budget = {.alpha = .5}, .levels = 3};
    budget_divide(&options.budget, 3, 1, 0);
    tall_factors f[2];
    for (int k = 0; k < 2; k++) {
        omp_set_num_threads(k == 0 ? 1 : 3);
        f[k] = factors_of(&s, "hf", &options, NULL);
    }
    omp_set_num_threads(before);
    ck_assert_uint_eq(f[0].rank, f[1].rank);
    ck_assert_mem_eq(f[0].Q, f[1].Q, f[0].n * f[0].rank * sizeof *f[0].Q);
    ck_assert_mem_eq(f[0].V, f[1].V, f[0].n * f[0].rank * sizeof *f[0].V);
    for (int k = 0; k < 2; k++) tall_factors_free(&f[k]);
    subject_free(&s);
}
END_TEST

START_TEST(forecast_knows_the_samples) {
    subject s;
    lam_error error = {0};
    hf_forecast *forecast = NULL;
    subject_make(&s, unit_cube, 3); /* 54 elements: the sample is all */
    double *values = values_of_difference(&s.S, NULL);
    ck_assert_int_eq(hf_forecast_create(&s.S, &forecast, &error), LAM_OK);
    for (double p = .3; p > .02; p *= .7) {
        size_t kept = 0;
        while (kept < s.S.n && values[kept] >= p) kept++;
        ck_assert_double_eq_tol(hf_forecast_rank(forecast, (double)s.S.n, p), (double)kept, 1.5);
    }
    const factorizer_options options = {.epsilon = .1, .budget = {.alpha = .5}, .levels = -1};
    hf_plan plan = hf_forecast_plan(forecast, &options), other = {.levels = 0, .left = {.1}};
    ck_assert_double_le(hf_forecast_seconds(forecast, &options, &plan),
                        hf_forecast_seconds(forecast, &options, &other));
    hf_forecast_free(forecast);
    free(values);
    subject_free(&s);
}
END_TEST

/* A Poisson variate of this mean: hits of rays (Knuth 1969). */
static int poisson(double mean, uint64_t *state) {
    int count = 0;
    for (double left = exp(-mean), at = random_lcg_unit(state); at > left; at *= random_lcg_unit(state))
        count++;
    return count;
}

/* Entries of a symmetric F as so many rays from each of the two elements count them. */
static void count_rays(csr *F, double rays) {
    uint64_t state = 9;
    for (size_t i = 0; i < F->n; i++)
        for (uint64_t p = F->indptr[i]; p < F->indptr[i + 1]; p++) {
            const size_t j = F->indices[p];
            if (i < j) F->data[p] = (float)(poisson((double)F->data[p] * 2 * rays, &state) / (2 * rays));
            for (uint64_t q = F->indptr[j]; i > j && q < F->indptr[j + 1]; q++)
                if (F->indices[q] == i) F->data[p] = F->data[q];
        }
}

/* Values of noise spread as columns become more: what few columns of it do not pass, many do. A forecast that
 * forgets it promises ranks that HF then does not find. */
START_TEST(forecast_knows_noise) {
    enum { RAYS = 40 };
    subject s;
    lam_error error = {0};
    hf_forecast *forecast = NULL;
    sparse_block block = {0};
    subject_make(&s, unit_cube, 15);
    count_rays(&s.f.F, RAYS);
    ck_assert_int_eq(hf_forecast_create(&s.S, &forecast, &error), LAM_OK);
    const size_t m = s.S.n / 2;
    double *values = malloc(m * sizeof *values);
    ck_assert_int_eq(scaled_block(&s.S, 0, m, &block, &error), LAM_OK);
    ck_assert_int_eq(tsvd_values(&block, m, values, &error), LAM_OK);
    const double noise = sqrt(1. / (2 * RAYS)); /* the length of a column of it: the rows of F sum to 1 */
    for (double p = 1.6 * noise; p > .5 * noise; p -= .1 * noise) {
        size_t kept = 0;
        while (kept < m && values[m - 1 - kept] >= p * p) kept++;
        ck_assert_double_ge(hf_forecast_rank(forecast, (double)m, p), .95 * (double)kept);
    }
    free(values);
    sparse_block_free(&block);
    hf_forecast_free(forecast);
    subject_free(&s);
}
END_TEST

/* Forecast of a plan's bytes where nodes are computed one after the other. */
static double bytes_alone(const hf_plan *plan, const subject *s) {
    const double n = (double)s->S.n;
    const hf_walk walk = {.n = s->S.n, .entries = n * s->rows.density, .alone = 20, .threads = 1};
    return hf_plan_bytes(plan, &walk, 0);
}

/* A plan keeps to the memory if any does, and else takes the least; noise below the bound of a leaf makes
 * some numbers of levels keep all of their columns. */
START_TEST(plans_keep_to_the_memory) {
    subject s;
    lam_error error = {0};
    hf_forecast *forecast = NULL;
    subject_make(&s, unit_cube, 15);
    count_rays(&s.f.F, 100);
    ck_assert_int_eq(hf_forecast_create(&s.S, &forecast, &error), LAM_OK);
    /* The fastest plan is that of the fewest bytes, or another. */
    static const double epsilon[2] = {.2, .4}, alpha[2] = {.5, .25};
    factorizer_options options = {.epsilon = epsilon[_i], .budget = {.alpha = alpha[_i]}};
    double fewest = INFINITY, most = 0;
    for (options.levels = 0; options.levels <= 4; options.levels++) {
        const hf_plan plan = hf_forecast_plan(forecast, &options);
        fewest = fmin(fewest, bytes_alone(&plan, &s));
        most = fmax(most, bytes_alone(&plan, &s));
    }
    ck_assert_double_gt(most, 1.5 * fewest); /* there is a choice */
    options.levels = -1;
    const hf_plan fastest = hf_forecast_plan(forecast, &options);
    ck_assert((bytes_alone(&fastest, &s) > 1.2 * fewest) == (_i == 1));
    double before = 0;
    for (double memory = 2 * most; memory > .5 * fewest; memory *= .8) {
        options.memory = (size_t)memory;
        const hf_plan plan = hf_forecast_plan(forecast, &options);
        const double bytes = bytes_alone(&plan, &s);
        ck_assert_msg(bytes <= fmax(memory, 1.001 * fewest), "%g bytes of %g, %g are enough", bytes, memory,
                      fewest);
        hf_plan copy = plan;
        const double takes = hf_forecast_seconds(forecast, &options, &copy);
        ck_assert_double_ge(takes, .999 * before); /* less memory is not faster */
        before = takes;
    }
    hf_forecast_free(forecast);
    subject_free(&s);
}
END_TEST

/* Threads that work at once take more, and nodes one after the other less. */
START_TEST(bytes_grow_with_threads) {
    const hf_plan plan = {.levels = 3, .left = {.1, 0, .05, .05}, .kept = {400, 400, 200, 100}};
    ck_assert_int_eq(hf_plan_below(&plan, 0), 2);
    ck_assert_int_eq(hf_plan_below(&plan, 2), 3);
    double before = 0;
    for (int threads = 1; threads <= 16; threads *= 2) {
        hf_walk walk = {.n = 10000, .entries = 500, .threads = threads};
        const double bytes = hf_plan_bytes(&plan, &walk, 0);
        ck_assert_double_ge(bytes, before);
        before = bytes;
        walk.alone = plan.levels;
        const double fewer = hf_plan_bytes(&plan, &walk, 0);
        ck_assert(threads == 1 ? fewer == bytes : fewer < bytes);
        /* Q and V of the four children of the root wait for each other. */
        ck_assert_double_gt(bytes, 4 * sizeof(float) * (10000 + 2500) * 200.);
    }
}
END_TEST

int main(void) {
    Suite *suite = suite_create("hf");
    TCase *cases = tcase_create("hf");
    tcase_set_timeout(cases, 300);
    tcase_add_test(cases, shares_fill_the_budget);
    tcase_add_test(cases, hf_keeps_its_bound);
    tcase_add_test(cases, errors_add_in_squares);
    tcase_add_test(cases, hf_rank_is_near_the_best);
    tcase_add_test(cases, bits_do_not_depend_on_threads);
    tcase_add_test(cases, forecast_knows_the_samples);
    tcase_add_test(cases, forecast_knows_noise);
    tcase_add_loop_test(cases, plans_keep_to_the_memory, 0, 2);
    tcase_add_test(cases, bytes_grow_with_threads);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
