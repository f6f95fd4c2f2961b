/* Every factorizer against a dense SVD in double: the bound, the rank, the basis. */
#include "solver/build/factorizer.h"
#include "solver/build/gram.h"
#include "solver/build/hf.h"
#include "solver/build/norm.h"
#include "solver/build/sketch.h"
#include "support/box_problem.h"
#include "support/transport.h"

#include <lapacke.h>
#include <omp.h>

static const char *const names[] = {"hf", "svd", "rsi", "sgrsvd"};
enum { NAMES = sizeof names / sizeof *names };

/* A matrix to be factorized. */
typedef struct subject {
    fixture f;
    row_source rows;
    scaled_matrix S;
} subject;

static void subject_make(subject *s, const double size[3], unsigned divisions) {
    lam_error error = {0};
    s->f = fixture_box(size, divisions, .5f);
    row_source_of_csr(&s->rows, &s->f.F);
    ck_assert_int_eq(scaled_init(&s->S, &s->rows, s->f.m.area, s->f.order, &error), LAM_OK);
}

static void subject_free(subject *s) {
    scaled_free(&s->S);
    fixture_free(&s->f);
}

static tall_factors factors_of(const subject *s, const char *name, const factorizer_options *options,
                               factorizer_report *report) {
    tall_factors f = {0};
    lam_error error = {0};
    factorizer_report unread;
    ck_assert_msg(factorize(name, &s->S, options, &f, report != NULL ? report : &unread, &error) == LAM_OK,
                  "%s: %s", name, error.message);
    ck_assert_uint_eq(f.n, s->S.n);
    ck_assert_uint_eq(f.m, s->S.n);
    return f;
}

/* The singular values of S - Q V^T, falling, by LAPACK in double; freed by the caller. */
static double *values_of_difference(const scaled_matrix *S, const tall_factors *f) {
    const size_t n = S->n;
    float *dense = malloc(n * n * sizeof *dense);
    double *D = malloc(n * n * sizeof *D), *values = malloc(n * sizeof *values),
           *extra = malloc(n * sizeof *extra);
    lam_error error = {0};
    ck_assert_int_eq(scaled_dense(S, dense, &error), LAM_OK);
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            double sum = (double)dense[i * n + j];
            for (size_t k = 0; f != NULL && k < f->rank; k++)
                sum -= (double)f->Q[i * f->rank + k] * (double)f->V[j * f->rank + k];
            D[i * n + j] = sum;
        }
    ck_assert_int_eq(LAPACKE_dgesvd(LAPACK_ROW_MAJOR, 'N', 'N', (int)n, (int)n, D, (int)n, values, NULL, 1,
                                    NULL, 1, extra),
                     0);
    free(dense);
    free(D);
    free(extra);
    return values;
}

static double norm_of_difference(const scaled_matrix *S, const tall_factors *f) {
    double *values = values_of_difference(S, f);
    const double norm = values[0];
    free(values);
    return norm;
}

static void check_orthonormal(const tall_factors *f) {
    for (size_t a = 0; a < f->rank; a++)
        for (size_t b = 0; b <= a; b++) {
            double dot = 0;
            for (size_t i = 0; i < f->m; i++)
                dot += (double)f->V[i * f->rank + a] * (double)f->V[i * f->rank + b];
            ck_assert_double_eq_tol(dot, a == b ? 1 : 0, 2e-5);
        }
}

/* --- the shares of the levels ----------------------------------------------------------------------------
 */

START_TEST(shares_fill_the_budget) {
    const double alphas[] = {.1, .5, .9}, ratios[] = {.5, 1, 4};
    for (int a = 0; a < 3; a++)
        for (int r = 0; r < 3; r++)
            for (int levels = 0; levels <= 8; levels++) {
                budget b = {.rule = BUDGET_SQUARES, .alpha = alphas[a]};
                budget_divide(&b, levels, ratios[r], levels % 3 * .3);
                double p[BUDGET_LEVELS_MOST + 1], sum = 0;
                budget_share(&b, .1, levels, p);
                for (int l = 0; l <= levels; l++) sum += ldexp(p[l] * p[l], l);
                ck_assert_double_eq_tol(sum, .01, 1e-12); /* sum_l 2^l p_l^2 = epsilon^2 */
                if (levels > 0) ck_assert_double_eq_tol(p[0] * p[0], alphas[a] * .01, 1e-12);
            }
    /* Eq. 3.20: e_p = epsilon / 2, e_ch = epsilon / (2 sqrt(2)). */
    const budget sums = {.rule = BUDGET_SUMS, .alpha = .5};
    double p[BUDGET_LEVELS_MOST + 1];
    budget_share(&sums, .1, 1, p);
    ck_assert_double_eq_tol(p[0], .05, 1e-12);
    ck_assert_double_eq_tol(p[1], .1 / (2 * sqrt(2)), 1e-12);
    budget_rule rule;
    for (int k = 0; k <= BUDGET_FROBENIUS; k++) {
        ck_assert(budget_rule_find(budget_rule_name((budget_rule)k), &rule));
        ck_assert_int_eq((int)rule, k);
    }
    ck_assert(!budget_rule_find("cubes", &rule));
}
END_TEST

/* --- HF --------------------------------------------------------------------------------------------------
 */

static const budget_rule rules[] = {BUDGET_SQUARES, BUDGET_SUMS, BUDGET_FROBENIUS};

START_TEST(hf_keeps_its_bound) {
    subject s;
    lam_error error = {0};
    subject_make(&s, room, 5); /* 150 elements, areas differ from face to face */
    const double epsilons[] = {.3, .1, .01, 1e-4}, alphas[] = {.1, .5, .9};
    for (int e = 0; e < 4; e++)
        for (int a = 0; a < 3; a++)
            for (int levels = 0; levels <= 4; levels++) {
                factorizer_options options = {.epsilon = epsilons[e],
                                              .budget = {.rule = rules[_i], .alpha = alphas[a]},
                                              .levels = levels};
                budget_divide(&options.budget, levels, levels % 2 ? .5 : 2, 0);
                if (levels > 1 && a != 1) { /* a level without nodes: four are joined at once */
                    options.budget.part[levels] += options.budget.part[1];
                    options.budget.part[1] = 0;
                }
                factorizer_report report;
                tall_factors f = factors_of(&s, "hf", &options, &report);
                double *values = values_of_difference(&s.S, &f), squares = 0, lanczos, frobenius;
                for (size_t i = 0; i < s.S.n; i++) squares += values[i] * values[i];
                const double norm = rules[_i] == BUDGET_FROBENIUS ? sqrt(squares) : values[0];
                /* Rounding of the factors: 1e-6 of |S| = 1; sqrt(n) of that in the Frobenius norm. */
                ck_assert_msg(norm <= epsilons[e] + (rules[_i] == BUDGET_FROBENIUS ? 3e-5 : 2e-6),
                              "epsilon %g, alpha %g, %d levels: error %g", epsilons[e], alphas[a], levels,
                              norm);
                ck_assert_int_eq(norm_of_error(&s.S, &f, NULL, &lanczos, &error), LAM_OK);
                ck_assert_msg(lanczos <= values[0] * 1.0001 + 1e-7 && lanczos >= .97 * values[0] - 1e-6,
                              "norm %g, found %g", values[0], lanczos);
                /* sqrt(|S|_F^2 - |Q|_F^2) loses what squares of single precision lose. */
                ck_assert_int_eq(norm_of_error_frobenius(&s.S, &f, &frobenius, &error), LAM_OK);
                ck_assert_double_eq_tol(frobenius, sqrt(squares), 1e-5 + 2e-5 / (1e-3 + sqrt(squares)));
                check_orthonormal(&f);
                ck_assert_int_eq(report.levels, levels);
                ck_assert_double_eq(report.passes, 1);
                tall_factors_free(&f);
                free(values);
            }
    subject_free(&s);
}
END_TEST

/* What a node leaves out is orthogonal to what its parent drops: with all of a level's error in one place the
 * bound of squares is nearly reached, and that of sums is far. */
START_TEST(errors_add_in_squares) {
    subject s;
    subject_make(&s, unit_cube, 5);
    for (int levels = 1; levels <= 3; levels++) {
        factorizer_options options = {
            .epsilon = .2, .budget = {.rule = BUDGET_SQUARES, .alpha = .5}, .levels = levels};
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

/* --- all -------------------------------------------------------------------------------------------------
 */

START_TEST(every_factorizer_keeps_its_bound) {
    subject s;
    subject_make(&s, room, 5);
    const double epsilons[] = {.3, .1, .02};
    for (int e = 0; e < 3; e++) {
        const factorizer_options options = {
            .epsilon = epsilons[e], .budget = {.alpha = .5}, .levels = -1, .iterations = -1, .seed = 5};
        tall_factors f = factors_of(&s, names[_i], &options, NULL);
        ck_assert_double_le(norm_of_difference(&s.S, &f), epsilons[e] + 2e-6);
        check_orthonormal(&f);
        tall_factors_free(&f);
    }
    subject_free(&s);
}
END_TEST

START_TEST(fixed_rank_is_exact) {
    subject s;
    subject_make(&s, unit_cube, 4); /* 96 elements */
    double *values = values_of_difference(&s.S, NULL);
    const size_t ranks[] = {1, 7, 50, 96, 1000};
    for (int k = 0; k < 5; k++) {
        const factorizer_options options = {
            .rank = ranks[k], .budget = {.alpha = .5}, .levels = 2, .iterations = -1, .seed = 5};
        factorizer_report report;
        tall_factors f = factors_of(&s, names[_i], &options, &report);
        const double norm = norm_of_difference(&s.S, &f);
        ck_assert_uint_eq(f.rank, ranks[k] < 96 ? ranks[k] : 96);
        /* Never better than the best (Eckart and Young), and not far from it. */
        const double best = f.rank < 96 ? values[f.rank] : 0;
        ck_assert_double_ge(norm, best - 2e-6);
        ck_assert_msg(norm <= 3 * best + 5e-6, "%s, rank %zu: %g, best %g", names[_i], f.rank, norm, best);
        ck_assert_double_ge(report.passes, 1);
        tall_factors_free(&f);
    }
    free(values);
    subject_free(&s);
}
END_TEST

/* Nothing sees anything; one element; the same element many times. */
START_TEST(odd_matrices) {
    lam_error error = {0};
    enum { N = 40 };
    static uint64_t none[N + 1];
    uint32_t order[N];
    double area[N];
    for (uint32_t i = 0; i < N; i++) {
        order[i] = i;
        area[i] = pow(10, (double)i / 5); /* eight decades */
    }
    for (size_t n = 1; n <= N; n += N - 1) {
        csr F = {.n = n, .indptr = none};
        row_source rows;
        scaled_matrix S;
        row_source_of_csr(&rows, &F);
        ck_assert_int_eq(scaled_init(&S, &rows, area, order, &error), LAM_OK);
        for (int rank = 0; rank <= 3; rank += 3) {
            const factorizer_options options = {
                .epsilon = .1, .rank = (size_t)rank, .budget = {.alpha = .5}, .levels = -1, .iterations = -1};
            tall_factors f = {0};
            factorizer_report report;
            ck_assert_msg(factorize(names[_i], &S, &options, &f, &report, &error) == LAM_OK, "%s: %s",
                          names[_i], error.message);
            ck_assert_uint_eq(f.rank, rank == 0 ? 0 : n < 3 ? n : 3);
            for (size_t k = 0; k < n * f.rank; k++) ck_assert_float_eq(f.Q[k], 0);
            for (size_t k = 0; k < n * f.rank; k++) ck_assert(isfinite(f.V[k]));
            tall_factors_free(&f);
        }
        scaled_free(&S);
    }
}
END_TEST

START_TEST(norms_never_pass_one) {
    subject s;
    subject_make(&s, unit_cube, 5); /* closed: |S| = 1 */
    for (size_t rank = 1; rank <= 150; rank = 3 * rank + 1) {
        const factorizer_options options = {
            .rank = rank, .budget = {.alpha = .5}, .levels = 2, .iterations = 0, .seed = 11};
        tall_factors f = factors_of(&s, names[_i], &options, NULL);
        double *largest = calloc(f.rank, sizeof *largest);
        for (size_t c = 0; c < f.rank; c++) {
            double sum = 0;
            for (size_t i = 0; i < f.n; i++) sum += (double)f.Q[i * f.rank + c] * (double)f.Q[i * f.rank + c];
            /* Columns of Q are orthogonal: each is a singular value of Q V^T. */
            ck_assert_double_le(sqrt(sum), 1 + 1e-5);
        }
        free(largest);
        tall_factors_free(&f);
    }
    subject_free(&s);
}
END_TEST

/* --- pieces ----------------------------------------------------------------------------------------------
 */

START_TEST(products_are_right) {
    subject s;
    lam_error error = {0};
    subject_make(&s, room, 4);
    enum { W = 20 };
    const size_t n = s.S.n;
    float *dense = malloc(n * n * sizeof *dense), *X = malloc(n * W * sizeof *X),
          *Y = malloc(n * W * sizeof *Y);
    double *x = malloc(n * sizeof *x), *y = malloc(n * sizeof *y);
    ck_assert_int_eq(scaled_dense(&s.S, dense, &error), LAM_OK);
    sketch_gaussian(3, n, W, X);
    for (int by_blas = 0; by_blas < 2; by_blas++) {
        s.rows.density = by_blas ? 1 : 0;
        ck_assert_int_eq(scaled_multiply(&s.S, W, X, Y, &error), LAM_OK);
        for (size_t v = 0; v < W; v++) {
            for (size_t i = 0; i < n; i++) x[i] = (double)X[i * W + v];
            ck_assert_int_eq(scaled_multiply_double(&s.S, x, y, &error), LAM_OK);
            for (size_t i = 0; i < n; i++) {
                double sum = 0;
                for (size_t j = 0; j < n; j++) sum += (double)dense[i * n + j] * x[j];
                ck_assert_double_eq_tol(y[i], sum, 1e-6);
                ck_assert_double_eq_tol((double)Y[i * W + v], sum, 1e-5);
            }
        }
    }
    sparse_block block = {0};
    ck_assert_int_eq(scaled_block(&s.S, 10, 30, &block, &error), LAM_OK);
    for (size_t i = 0; i < n; i++)
        for (uint64_t p = block.indptr[i]; p < block.indptr[i + 1]; p++) {
            ck_assert(p == block.indptr[i] || block.columns[p] > block.columns[p - 1]);
            ck_assert_float_eq_tol(block.data[p], dense[i * n + 10 + block.columns[p]], 1e-7f);
        }
    sparse_block_free(&block);
    free(dense);
    free(X);
    free(Y);
    free(x);
    free(y);
    subject_free(&s);
}
END_TEST

/* Rows with few entries and rows that are spread out give the same Gram matrix, in either precision. */
START_TEST(gram_matrices_agree) {
    enum { N = 700, M = 300 };
    lam_error error = {0};
    sparse_block A = {.n = N, .m = M};
    A.indptr = calloc(N + 1, sizeof *A.indptr);
    A.columns = malloc(N * M * sizeof *A.columns);
    A.data = malloc(N * M * sizeof *A.data);
    float *dense = calloc(N * M, sizeof *dense);
    for (size_t i = 0; i < N; i++) {
        A.indptr[i + 1] = A.indptr[i];
        for (size_t j = i % 7; j < M; j += i % 3 == 0 ? 2 : 1 + i % 60) {
            A.columns[A.indptr[i + 1]] = (uint32_t)j;
            dense[i * M + j] = A.data[A.indptr[i + 1]++] = (float)sin((double)(i * 31 + j));
        }
    }
    gram g[4];
    for (int k = 0; k < 4; k++) {
        ck_assert_int_eq(gram_create(M, k % 2 == 0, &g[k], &error), LAM_OK);
        if (k < 2)
            ck_assert_int_eq(gram_add_sparse(&g[k], &A, &error), LAM_OK);
        else
            ck_assert_int_eq(gram_add(&g[k], N, dense, &error), LAM_OK);
    }
    for (size_t i = 0; i < M; i++)
        for (size_t j = i; j < M; j++) {
            const double truth = g[3].full[i * M + j];
            ck_assert_double_eq_tol(g[1].full[i * M + j], truth, 1e-10);
            ck_assert_double_eq_tol((double)g[0].single[i * M + j], truth, 2e-4);
            ck_assert_double_eq_tol((double)g[2].single[i * M + j], truth, 2e-4);
        }
    for (int k = 0; k < 4; k++) gram_free(&g[k]);
    sparse_block_free(&A);
    free(dense);
}
END_TEST

/* How often rays hit what they meet so often on average (Knuth 1969). */
static int poisson(double mean, uint64_t *state) {
    int count = 0;
    for (double left = exp(-mean), at = random_unit(state); at > left; at *= random_unit(state)) count++;
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

/* The largest x^T G x over |x| = 1 orthogonal to V, by all eigenvalues of (I - V V^T) G (I - V V^T). */
static double largest_orthogonal(const gram *g, const float *V, size_t rank) {
    lam_error error = {0};
    const size_t m = g->m;
    gram D;
    ck_assert_int_eq(gram_create(m, false, &D, &error), LAM_OK);
    double *P = calloc(m * m, sizeof *P), *half = calloc(m * m, sizeof *half),
           *values = malloc(m * sizeof *values);
    for (size_t i = 0; i < m; i++)
        for (size_t j = 0; j < m; j++) {
            double dot = 0;
            for (size_t c = 0; c < rank; c++) dot += (double)V[i * rank + c] * (double)V[j * rank + c];
            P[i * m + j] = (double)(i == j) - dot;
        }
    for (size_t i = 0; i < m; i++)
        for (size_t k = 0; k < m; k++)
            for (size_t j = 0; j < m; j++)
                half[i * m + j] += (double)g->single[(i < k ? i : k) * m + (i < k ? k : i)] * P[k * m + j];
    for (size_t i = 0; i < m; i++)
        for (size_t k = 0; k < m; k++)
            for (size_t j = 0; j < m; j++) D.full[i * m + j] += P[i * m + k] * half[k * m + j];
    ck_assert_int_eq(gram_eigen(&D, false, values, &error), LAM_OK);
    const double largest = values[m - 1];
    free(P);
    free(half);
    free(values);
    gram_free(&D);
    return largest;
}

/* Few eigenvectors above a floor: none that matters is missed, and many are left to the whole decomposition:
 * above or near the floor there are more than a tenth. */
static void check_leading(gram *g, double floor, size_t many) {
    lam_error error = {0};
    float *V = NULL;
    size_t rank = 0;
    ck_assert_int_eq(gram_leading(g, floor, 0, &V, &rank, &error), LAM_OK);
    if (V == NULL)
        ck_assert_uint_gt(many, g->m / 10);
    else
        ck_assert_double_le(largest_orthogonal(g, V, rank), 1.02 * floor + 1e-6);
    free(V);
}

START_TEST(leading_eigenvectors) {
    enum { M = 300 };
    lam_error error = {0};
    gram g, all;
    ck_assert_int_eq(gram_create(M, true, &g, &error), LAM_OK);
    ck_assert_int_eq(gram_create(M, true, &all, &error), LAM_OK);
    /* Columns of noise, falling from 1. */
    float *X = malloc(M * M * sizeof *X);
    sketch_gaussian(1, M, M, X);
    for (size_t c = 0; c < M; c++)
        for (size_t r = 0; r < M; r++) X[r * M + c] *= (float)(exp(-.05 * (double)c) / sqrt(M));
    ck_assert_int_eq(gram_add(&g, M, X, &error), LAM_OK);
    memcpy(all.single, g.single, M * M * sizeof *g.single);
    double values[M];
    ck_assert_int_eq(gram_eigen(&all, false, values, &error), LAM_OK);
    for (double floor = .3; floor > 1e-9; floor /= 9) {
        size_t above = 0;
        for (size_t k = 0; k < M; k++) above += values[k] >= floor;
        check_leading(&g, floor, above);
    }
    /* A plateau just above the floor on another just below: a few steps do not tell them apart. */
    for (size_t plateau = 1; plateau <= M; plateau *= 2) {
        memset(g.single, 0, M * M * sizeof *g.single);
        for (size_t i = 0; i < M; i++) g.single[i * M + i] = i < plateau ? 1.1f : .85f;
        check_leading(&g, 1, M);
    }
    free(X);
    gram_free(&g);
    gram_free(&all);
}
END_TEST

START_TEST(bases_are_orthonormal) {
    enum { N = 500, M = 40 };
    lam_error error = {0};
    float *Y = malloc(N * M * sizeof *Y);
    for (int dependent = 0; dependent < 2; dependent++) {
        size_t rank;
        sketch_gaussian(2, N, M, Y);
        for (size_t i = 0; i < N; i++)
            for (size_t c = 0; c < M; c++) {
                Y[i * M + c] *= (float)pow(10, -(double)c / 10);
                if (dependent && c >= M / 2) Y[i * M + c] = Y[i * M + c - M / 2];
            }
        ck_assert_int_eq(sketch_orthonormalize(N, M, Y, &rank, &error), LAM_OK);
        ck_assert_uint_eq(rank, dependent ? M / 2 : M);
        const tall_factors f = {.n = N, .m = N, .rank = rank, .V = Y};
        check_orthonormal(&f);
    }
    free(Y);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("factorizers");
    TCase *cases = tcase_create("factorizers");
    tcase_set_timeout(cases, 300);
    tcase_add_test(cases, shares_fill_the_budget);
    tcase_add_loop_test(cases, hf_keeps_its_bound, 0, 3);
    tcase_add_test(cases, errors_add_in_squares);
    tcase_add_test(cases, hf_rank_is_near_the_best);
    tcase_add_test(cases, bits_do_not_depend_on_threads);
    tcase_add_test(cases, forecast_knows_the_samples);
    tcase_add_test(cases, forecast_knows_noise);
    tcase_add_loop_test(cases, every_factorizer_keeps_its_bound, 0, NAMES);
    tcase_add_loop_test(cases, fixed_rank_is_exact, 0, NAMES);
    tcase_add_loop_test(cases, odd_matrices, 0, NAMES);
    tcase_add_loop_test(cases, norms_never_pass_one, 0, NAMES);
    tcase_add_test(cases, products_are_right);
    tcase_add_test(cases, gram_matrices_agree);
    tcase_add_test(cases, leading_eigenvectors);
    tcase_add_test(cases, bases_are_orthonormal);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
