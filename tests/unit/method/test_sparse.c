/* The sparse inverse: algorithms 5 and 6 of the thesis written out densely in double, and what is owed by any
 * operator. */
#include "solver/method/sparse/sparse_inverse.h"
#include "solver/operator/sparse.h"
#include "support/box_problem.h"
#include "support/building.h"
#include "support/suite.h"
#include "support/transport.h"

#include <omp.h>

static lam_error error;

/* A room with uneven reflectances, every seventh 0. */
static fixture subject(unsigned divisions) {
    fixture f = fixture_box(room, divisions, .5f);
    for (size_t i = 0; i < f.m.n; i++) f.m.reflectance[i] = i % 7 == 3 ? 0 : .3f + .5f * (float)(i % 11) / 11;
    return f;
}

enum { NONE, DELTA, DISCARDED };
static const char *const corrections[] = {"none", "delta", "discarded"};

static build_options options_of(double threshold, int correction) {
    build_options options = build_presets("sparse");
    set_number(&options, "threshold", threshold);
    set_text(&options, "correction", corrections[correction]);
    return options;
}

static lam_operator *build(const build_problem *problem, const build_options *options, build_report *report) {
    lam_operator *op = NULL;
    ck_assert_msg(build_operator(problem, options, &op, report, &error) == LAM_OK, "%s", error.message);
    return op;
}

/* A sum of products of single-precision numbers may fall to either side of the threshold: such entries are
 * looked away from. */
static bool is_close(double x, double threshold) {
    return fabs(x / threshold - 1) < 1e-5;
}

typedef struct dense_inverse {
    double *M, *discarded; /* M~ - I by position, and delta of algorithm 6 with what R F lacks */
    bool *unsure;          /* [n], a row with an entry close to the threshold */
} dense_inverse;

/* remove(T, threshold) of one row; returns what was removed. */
static double remove_small(double *T, size_t n, double threshold, bool *unsure) {
    double removed = 0;
    for (size_t j = 0; j < n; j++) {
        *unsure = *unsure || (T[j] > 0 && is_close(T[j], threshold));
        if (T[j] >= threshold) continue;
        removed += T[j];
        T[j] = 0;
    }
    return removed;
}

static dense_inverse dense(const fixture *f, double threshold) {
    const size_t n = f->m.n;
    dense_inverse d = {.M = test_allocate(n * n, sizeof(double)),
                       .discarded = test_allocate(n, sizeof(double)),
                       .unsure = test_allocate(n, sizeof(bool))};
    double *whole = test_allocate(n * n, sizeof *whole), *RF = test_allocate(n * n, sizeof *RF);
    double *lost = test_allocate(n, sizeof *lost), *T = test_allocate(n, sizeof *T);
    double *next = test_allocate(n, sizeof *next);
    bool any = false;
    uint32_t *position = test_allocate(n, sizeof *position);
    for (size_t p = 0; p < n; p++) position[f->order[p]] = (uint32_t)p;
    for (size_t p = 0; p < n; p++) {
        const size_t i = f->order[p];
        const double rho = (double)f->m.reflectance[i];
        for (uint64_t e = f->F.indptr[i]; e < f->F.indptr[i + 1]; e++) {
            whole[p * n + position[f->F.indices[e]]] = (rho > 0 ? rho : 1) * (double)f->F.data[e];
            RF[p * n + position[f->F.indices[e]]] = rho * (double)f->F.data[e];
        }
        lost[p] = remove_small(RF + p * n, n, threshold, &any);
    }
    for (size_t p = 0; p < n; p++) {
        memcpy(T, whole + p * n, n * sizeof *T);
        d.discarded[p] = remove_small(T, n, threshold, &d.unsure[p]);
        for (bool left = true; left;) {
            left = false;
            memset(next, 0, n * sizeof *next);
            for (size_t k = 0; k < n; k++) {
                d.M[p * n + k] += T[k];
                d.discarded[p] += T[k] * lost[k];
                for (size_t j = 0; j < n && T[k] > 0; j++) next[j] += T[k] * RF[k * n + j];
            }
            d.discarded[p] += remove_small(next, n, threshold, &d.unsure[p]);
            for (size_t k = 0; k < n; k++) left = left || next[k] > 0;
            memcpy(T, next, n * sizeof *T);
        }
    }
    ck_assert(!any);
    free(whole);
    free(RF);
    free(lost);
    free(T);
    free(next);
    free(position);
    return d;
}

static void dense_free(dense_inverse *d) {
    free(d->M);
    free(d->discarded);
    free(d->unsure);
}

START_TEST(rows_are_those_of_the_thesis) {
    static const double thresholds[] = {1e-2, 1e-3, 1e-4, 1e-9};
    fixture f = subject(4);
    const size_t n = f.m.n;
    sparse_inverse s;
    dense_inverse d = dense(&f, thresholds[_i]);
    size_t sure = 0;
    ck_assert_msg(sparse_inverse_rows(problem_of(&f), f.m.reflectance,
                                      &(sparse_limits){thresholds[_i], false}, 0, NULL, &s, &error) == LAM_OK,
                  "%s", error.message);
    for (size_t p = 0; p < n; p++) {
        uint64_t e = s.M.indptr[p];
        if (d.unsure[p]) continue;
        sure++;
        for (size_t j = 0; j < n; j++) {
            const double truth = d.M[p * n + j];
            if (truth <= 0) continue;
            ck_assert(e < s.M.indptr[p + 1] && s.M.indices[e] == j);
            ck_assert(fabs((double)s.M.data[e++] - truth) <= 1e-6 * truth);
        }
        ck_assert(e == s.M.indptr[p + 1]);
        ck_assert(fabs(s.discarded[p] - d.discarded[p]) <= 1e-5 * d.discarded[p] + 1e-7);
    }
    ck_assert_uint_gt(sure, n / 2);
    sparse_inverse_free(&s);
    dense_free(&d);
    fixture_free(&f);
}
END_TEST

static void apply(const lam_operator *op, lam_quantity quantity, const float *E, float *out) {
    const size_t bytes = lam_operator_work_bytes(op, 1);
    void *work = malloc(bytes);
    ck_assert(lam_operator_apply(op, 1, quantity, E, out, work, bytes, &error) == LAM_OK);
    free(work);
}

/* With a threshold of nearly nothing it is the inverse; with a large one delta makes uniform light exact, and
 * what was discarded, whose own bounces are forgotten, is less. */
START_TEST(corrections_do_what_they_say) {
    fixture f = subject(4);
    const size_t n = f.m.n;
    build_report report;
    float *E = test_allocate(n, sizeof *E), *truth = test_allocate(n, sizeof *truth);
    float *out = test_allocate(n, sizeof *out);
    const build_options exact = build_presets("exact");
    lam_operator *whole = build(problem_of(&f), &exact, &report);
    for (size_t i = 0; i < n; i++) E[i] = 1;
    for (int q = LAM_RADIOSITY; q <= LAM_IRRADIANCE; q++) {
        apply(whole, (lam_quantity)q, E, truth);
        double missing[3] = {0};
        for (int c = NONE; c <= DISCARDED; c++) {
            const build_options how = options_of(.02, c);
            lam_operator *op = build(&f.problem, &how, &report);
            ck_assert_double_eq(report_get(&report, "threshold", -1), .02);
            apply(op, (lam_quantity)q, E, out);
            for (size_t i = 0; i < n; i++) {
                missing[c] += (double)(truth[i] - out[i]) / (double)n;
                ck_assert(out[i] <= truth[i] * (1 + 1e-5f));
                if (c == DELTA) ck_assert(fabsf(out[i] - truth[i]) <= 1e-5f * truth[i]);
            }
            lam_operator_close(op);
        }
        ck_assert_double_gt(missing[NONE], 1.2 * missing[DISCARDED]);
        ck_assert_double_gt(missing[DISCARDED], 100 * fabs(missing[DELTA]));
        const build_options fine = options_of(1e-9, NONE);
        lam_operator *op = build(&f.problem, &fine, &report);
        apply(op, (lam_quantity)q, E, out);
        for (size_t i = 0; i < n; i++) ck_assert(fabsf(out[i] - truth[i]) <= 2e-6f * truth[i]);
        lam_operator_close(op);
    }
    lam_operator_close(whole);
    free(E);
    free(truth);
    free(out);
    fixture_free(&f);
}
END_TEST

/* Two rooms that do not see each other, the second of half the size: delta makes light that is even in each
 * of them exact, of as much as it shines there, and leaves the other one dark. */
START_TEST(delta_stays_within_parts) {
    static const double small[3] = {1, 1.2, .8};
    fixture f[2] = {subject(4), fixture_box(small, 3, .5f)};
    const size_t n[2] = {f[0].m.n, f[1].m.n}, all = n[0] + n[1];
    const uint64_t entries = f[0].F.indptr[n[0]] + f[1].F.indptr[n[1]];
    double *area = test_allocate(all, sizeof *area);
    float *rho = test_allocate(all, sizeof *rho), *E = test_allocate(all, sizeof *E);
    float *truth = test_allocate(all, sizeof *truth), *out = test_allocate(all, sizeof *out);
    uint32_t *order = test_allocate(all, sizeof *order);
    csr F = {.n = all, .indptr = test_allocate(all + 1, sizeof *F.indptr)};
    build_report report;
    ck_ok(csr_reserve(&F, entries, &error));
    for (size_t k = 0, at = 0; k < 2; k++)
        for (size_t i = 0; i < n[k]; i++) {
            const size_t row = k * n[0] + i;
            area[row] = f[k].m.area[i];
            rho[row] = f[k].m.reflectance[i];
            order[row] = (uint32_t)(all - 1 - row); /* no position is that of its element */
            for (uint64_t e = f[k].F.indptr[i]; e < f[k].F.indptr[i + 1]; e++) {
                F.indices[at] = (uint32_t)(k * n[0]) + f[k].F.indices[e];
                F.data[at++] = f[k].F.data[e];
            }
            F.indptr[row + 1] = at;
        }
    build_problem problem = *problem_of(&f[0]);
    problem.n = all;
    problem.F = &F;
    problem.area = area;
    problem.reflectance = rho;
    problem.order = order;
    problem.centre = NULL;
    problem.normal = NULL;
    problem.surface = NULL;
    const build_options exact = build_presets("exact"), how = options_of(.02, DELTA);
    lam_operator *whole = build(&problem, &exact, &report), *op = build(&problem, &how, &report);
    for (size_t lit = 0; lit < 2; lit++) {
        for (size_t i = 0; i < all; i++) E[i] = (i >= n[0]) == lit ? 2 : 0;
        apply(whole, LAM_IRRADIANCE, E, truth);
        apply(op, LAM_IRRADIANCE, E, out);
        for (size_t i = 0; i < all; i++) {
            ck_assert((truth[i] > 0) == (E[i] > 0));
            ck_assert(fabsf(out[i] - truth[i]) <= 1e-5f * truth[i]);
        }
    }
    lam_operator_close(whole);
    lam_operator_close(op);
    csr_free(&F);
    free(area);
    free(rho);
    free(E);
    free(truth);
    free(out);
    free(order);
    for (int k = 0; k < 2; k++) fixture_free(&f[k]);
}
END_TEST

START_TEST(bits_do_not_depend_on_threads) {
    fixture f = subject(6);
    sparse_inverse s[2];
    const int before = omp_get_max_threads();
    for (int k = 0; k < 2; k++) {
        omp_set_num_threads(k == 0 ? 1 : 4);
        ck_assert_int_eq(sparse_inverse_rows(problem_of(&f), f.m.reflectance, &(sparse_limits){1e-3, false},
                                             0, NULL, &s[k], &error),
                         LAM_OK);
    }
    omp_set_num_threads(before);
    const size_t entries = (size_t)s[0].M.indptr[f.m.n];
    ck_assert_uint_eq(s[1].M.indptr[f.m.n], entries);
    ck_assert_mem_eq(s[0].M.indices, s[1].M.indices, entries * sizeof(uint32_t));
    ck_assert_mem_eq(s[0].M.data, s[1].M.data, entries * sizeof(float));
    ck_assert_mem_eq(s[0].discarded, s[1].discarded, f.m.n * sizeof(double));
    for (int k = 0; k < 2; k++) sparse_inverse_free(&s[k]);
    fixture_free(&f);
}
END_TEST

/* The threshold rises until all entries fit, and is reported; where the forecast is exceeded nothing is kept.
 */
START_TEST(memory_bounds_the_entries) {
    fixture f = subject(6);
    build_report report;
    build_options how = options_of(1e-6, DELTA);
    lam_operator *op = build(problem_of(&f), &how, &report);
    const size_t all = lam_operator_bytes(op);
    lam_operator_close(op);
    ck_assert_double_eq(report_get(&report, "threshold", -1), 1e-6);
    how.memory = all / 4;
    op = build(&f.problem, &how, &report);
    ck_assert_double_gt(report_get(&report, "threshold", -1), 1e-6);
    ck_assert_uint_le(lam_operator_bytes(op), all / 4 + 16 * f.m.n);
    ck_assert_ptr_nonnull(strstr(report.reason, "raised"));
    lam_operator_close(op);
    sparse_inverse s;
    ck_assert_int_eq(sparse_inverse_rows(&f.problem, f.m.reflectance, &(sparse_limits){1e-6, false}, all / 4,
                                         NULL, &s, &error),
                     LAM_ERR_MEMORY);
    ck_assert_ptr_nonnull(strstr(error.message, "--threshold"));
    ck_assert_ptr_null(s.M.indptr);
    fixture_free(&f);
}
END_TEST

static bool always(void *context) {
    (void)context;
    return true;
}

START_TEST(bad_requests_are_refused) {
    static const double bad[] = {0, -1, 1, 2, NAN};
    fixture f = subject(2);
    build_report report;
    lam_operator *op = NULL;
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        build_options how = options_of(1e-3, DELTA);
        ck_assert_int_eq(build_set_number(&how, "threshold", bad[k], &error), LAM_ERR_ARGUMENT);
        ck_assert_ptr_nonnull(strstr(error.message, "--threshold"));
        if (bad[k] == 0) continue; /* not given */
        ((sparse_options *)own_options(&how, "sparse"))->threshold = bad[k];
        error.message[0] = '\0';
        ck_assert_int_eq(build_operator(problem_of(&f), &how, &op, &report, &error), LAM_ERR_ARGUMENT);
        ck_assert_ptr_nonnull(strstr(error.message, "--threshold"));
    }
    build_options how = options_of(1e-3, DELTA);
    how.progress = &(progress){.cancelled = always};
    ck_assert_int_eq(build_operator(&f.problem, &how, &op, &report, &error), LAM_ERR_CANCELLED);
    ck_assert_ptr_null(op);
    fixture_free(&f);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("sparse");
    TCase *cases = tcase_create("sparse");
    tcase_set_timeout(cases, 300);
    tcase_add_loop_test(cases, rows_are_those_of_the_thesis, 0, 4);
    tcase_add_test(cases, corrections_do_what_they_say);
    tcase_add_test(cases, delta_stays_within_parts);
    tcase_add_test(cases, bits_do_not_depend_on_threads);
    tcase_add_test(cases, memory_bounds_the_entries);
    tcase_add_test(cases, bad_requests_are_refused);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
