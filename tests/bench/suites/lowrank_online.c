/* Tables 1 to 5 of Fernández et al. 2011 at their sizes: V^T E by the index vector against a full V, and B~
 * in frames a second. V has a single 1 in each row, in runs of n/k, and the numbers of Y are arbitrary: no
 * time depends on them. Figures of GPUs are quoted from the paper; nothing ran on one. */
#include "solver/base/clock.h"
#include "solver/linalg/dense.h"
#include "solver/linalg/segments.h"
#include "solver/operator/two_mesh.h"
#include "tests/bench/suites/lowrank.h"
#include "tests/bench/suites/stats.h"

#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

enum { RUNS = 15 };

/* Total time of one measurement. */
static const double seconds_of_a_case = .6;

/* Median seconds of one call, of RUNS measurements with enough calls in each to be timed. */
static double time_of(void (*call)(void *), void *context) {
    double runs[RUNS], start = clock_seconds();
    call(context); /* the first fetches pages and caches */
    const double once = fmax(1e-8, clock_seconds() - start);
    const size_t calls = (size_t)fmax(1, fmin(1e6, seconds_of_a_case / RUNS / once));
    for (int r = 0; r < RUNS; r++) {
        start = clock_seconds();
        for (size_t i = 0; i < calls; i++) call(context);
        runs[r] = (clock_seconds() - start) / (double)calls;
    }
    return stats_median(runs, RUNS);
}

/* The first elements of k runs of n/k elements. */
static uint64_t *runs_of(size_t n, size_t k, lam_error *error) {
    uint64_t *begin = memory_allocate(k + 1, sizeof *begin, "runs", error);
    for (size_t p = 0; begin != NULL && p <= k; p++) begin[p] = p * n / k;
    return begin;
}

typedef struct product {
    size_t n, k;
    float *V_rows, *V_columns, *E, *t;
    segments sparse;
} product;

static void by_columns(void *context) { /* V is k columns of n */
    const product *p = context;
    dense_vector(p->n, p->k, p->V_columns, true, p->E, p->t);
}

static void by_rows(void *context) { /* V is n rows of k */
    const product *p = context;
    dense_vector(p->n, p->k, p->V_rows, false, p->E, p->t);
}

static void by_index(void *context) {
    const product *p = context;
    segments_sum(&p->sparse, p->E, p->t);
}

static lam_status add_product(size_t n, size_t k, double theirs, table *out, lam_error *error) {
    lam_status status = LAM_OK;
    product p = {.n = n, .k = k};
    uint64_t *begin = NULL;
    const int threads = omp_get_max_threads();
    double full[2];
    p.V_rows = memory_allocate(n, k * sizeof *p.V_rows, "V", error);
    p.V_columns = memory_allocate(n, k * sizeof *p.V_columns, "V", error);
    p.E = memory_allocate(n, sizeof *p.E, "E", error);
    p.t = memory_allocate(k, sizeof *p.t, "V^T E", error);
    begin = runs_of(n, k, error);
    if (p.V_rows == NULL || p.V_columns == NULL || p.E == NULL || p.t == NULL || begin == NULL)
        TRY(LAM_ERR_MEMORY);
    for (size_t j = 0; j < n; j++) p.E[j] = (float)(1 + j % 7);
    for (size_t q = 0; q < k; q++)
        for (uint64_t j = begin[q]; j < begin[q + 1]; j++) p.V_rows[j * k + q] = p.V_columns[q * n + j] = 1;
    uint64_t *taken = begin;
    begin = NULL;
    TRY(segments_create(n, k, taken, NULL, &p.sparse, error));
    for (int one = 1; one >= 0; one--) {
        omp_set_num_threads(one ? 1 : threads);
        full[one] = fmin(time_of(by_columns, &p), time_of(by_rows, &p));
    }
    const double sparse = time_of(by_index, &p);
    table_number(out, (double)n);
    table_number(out, (double)k);
    table_number(out, 1e6 * full[1]);
    table_number(out, 1e6 * full[0]);
    table_number(out, 1e6 * sparse);
    table_number(out, full[1] / sparse);
    table_number(out, full[0] / sparse);
    table_number(out, theirs);
done:
    omp_set_num_threads(threads);
    segments_free(&p.sparse);
    free(begin);
    free(p.V_rows);
    free(p.V_columns);
    free(p.E);
    free(p.t);
    return status;
}

static lam_status products(const bench_run *run, lam_error *error) {
    static const table_column columns[] = {
        {"elements", "", "n"},
        {"patches", "", "k"},
        {"full_one_thread_us", "us", "V^T E with a full V by OpenBLAS, the faster of both storage orders"},
        {"full_us", "us", "full V with all threads"},
        {"sparse_us", "us", "by the index vector, one thread"},
        {"ratio_one_thread", "", "full over sparse"},
        {"ratio", "", "full with all threads over sparse"},
        {"paper_ratio", "", "as published, CPU"},
    };
    static const struct {
        size_t n, k;
        double theirs;
    } cases[] = {{3456, 216, 15.67},    {3456, 864, 68.33},  {13824, 216, 21.67},
                 {3456, 3456, 75.75},   {13824, 864, 92.11}, {55296, 216, 17.42},
                 {13824, 3456, 335.50}, {55296, 864, 94.03}, {221184, 216, 24.01}};
    lam_status status = LAM_OK;
    table out = {.name = "index-vector",
                 .title = "V^T E by the index vector (Fernández et al. 2011: table 1)",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        if (run->scale == BENCH_QUICK && cases[i].n > 4000) continue;
        TRY(bench_check(run, error));
        TRY(add_product(cases[i].n, cases[i].k, cases[i].theirs, &out, error));
    }
    TRY(bench_table(run, &out, error));
done:
    table_free(&out);
    return status;
}

typedef struct solve {
    const lam_operator *op;
    const float *E;
    float *B;
    void *work;
    size_t work_bytes;
} solve;

static void apply(void *context) {
    const solve *s = context;
    /* Shapes that were right once stay right, so that this cannot fail. */
    (void)lam_operator_apply(s->op, 1, LAM_RADIOSITY, s->E, s->B, s->work, s->work_bytes, NULL);
}

/* Median seconds of one B~. */
static lam_status seconds_of_answer(const lam_operator *op, const float *E, double *seconds,
                                    lam_error *error) {
    lam_status status = LAM_OK;
    solve s = {.op = op, .E = E, .work_bytes = lam_operator_work_bytes(op, 1)};
    s.B = memory_allocate(lam_operator_elements(op), sizeof *s.B, "B", error);
    s.work = memory_allocate(s.work_bytes, 1, "B", error);
    if (s.B == NULL || s.work == NULL) TRY(LAM_ERR_MEMORY);
    TRY(lam_operator_apply(op, 1, LAM_RADIOSITY, E, s.B, s.work, s.work_bytes, error));
    *seconds = time_of(apply, &s);
done:
    free(s.B);
    free(s.work);
    return status;
}

/* Y [n][k] of arbitrary numbers. */
static float *made_up(size_t n, size_t k, lam_error *error) {
    float *Y = memory_allocate(n, k * sizeof *Y, "Y", error);
    for (size_t i = 0; Y != NULL && i < n * k; i++) Y[i] = -1e-4f * (float)(1 + i % 13);
    return Y;
}

static lam_status add_answer(const char *source, size_t n, size_t k, const double theirs[4], bool with_full,
                             table *out, lam_error *error) {
    lam_status status = LAM_OK;
    float *reflectance = NULL, *E = NULL;
    lam_operator *op = NULL;
    double sparse, full = NAN;
    reflectance = memory_allocate(n, sizeof *reflectance, "scene", error);
    E = memory_allocate(n, sizeof *E, "E", error);
    two_mesh_arrays arrays = {.left = made_up(n, k, error), .begin = runs_of(n, k, error)};
    if (reflectance == NULL || E == NULL || arrays.left == NULL || arrays.begin == NULL) {
        free(arrays.left);
        free(arrays.begin);
        TRY(LAM_ERR_MEMORY);
    }
    for (size_t i = 0; i < n; i++) {
        reflectance[i] = .5f;
        E[i] = (float)(1 + i % 7);
    }
    TRY(operator_two_mesh_create(n, k, 1, reflectance, &arrays, &op, error));
    lam_operator_set_threads(op, omp_get_max_threads());
    TRY(seconds_of_answer(op, E, &sparse, error));
    const double bytes = (double)lam_operator_bytes(op);
    lam_operator_close(op);
    op = NULL;
    if (with_full) {
        float *Y = made_up(n, k, error), *V = made_up(n, k, error);
        if (Y == NULL || V == NULL) {
            free(Y);
            free(V);
            TRY(LAM_ERR_MEMORY);
        }
        TRY(operator_low_rank_create_folded(n, k, reflectance, Y, V, &op, error));
        lam_operator_set_threads(op, omp_get_max_threads());
        TRY(seconds_of_answer(op, E, &full, error));
    }
    table_text(out, source);
    table_number(out, (double)n);
    table_number(out, (double)k);
    table_number(out, 1e3 * sparse);
    table_number(out, 1 / sparse);
    table_number(out, 1 / full);
    table_number(out, full / sparse);
    table_number(out, 1e-9 * bytes / sparse);
    for (int c = 0; c < 4; c++) table_number(out, theirs[c] > 0 ? theirs[c] : NAN);
done:
    lam_operator_close(op);
    free(reflectance);
    free(E);
    return status;
}

static lam_status answers(const bench_run *run, lam_error *error) {
    static const table_column columns[] = {
        {"table", NULL, "table of the paper"},
        {"elements", "", "n"},
        {"patches", "", "k"},
        {"ms", "ms", "time of one B~ with the index vector"},
        {"fps", "1/s", "B~ with the index vector"},
        {"fps_full", "1/s", "B~ with a full V"},
        {"speedup", "", "index vector over full V (table 2)"},
        {"gb_s", "GB/s", "rate at which Y is read"},
        {"paper_cpu_full", "1/s", "as published"},
        {"paper_cpu_sparse", "1/s", "as published"},
        {"paper_gpu_full_not_run", "1/s", "as published; nothing ran on a GPU"},
        {"paper_gpu_sparse_not_run", "1/s", "as published; nothing ran on a GPU"},
    };
    static const struct {
        const char *source;
        size_t n, k;
        double theirs[4];
    } cases[] = {{"2, 3", 3456, 216, {814, 1591, 1556, 7000}}, {"2, 3", 3456, 864, {221, 372, 1014, 2414}},
                 {"2, 3", 13824, 216, {196, 374, 395, 2059}},  {"2, 3", 3456, 3456, {70, 100, 278, 569}},
                 {"2, 3", 13824, 864, {51, 96, 273, 933}},     {"2, 3", 55296, 216, {47, 90, 100, 504}},
                 {"2, 3", 13824, 3456, {14, 24, 76, 275}},     {"2, 3", 55296, 864, {12, 23, 70, 252}},
                 {"2, 3", 221184, 216, {11, 23, 23, 116}},     {"4", 13824, 3456, {0, 74.07, 0, 297.87}},
                 {"4", 55296, 864, {0, 73.61, 0, 301.72}},     {"4", 221184, 216, {0, 72.92, 0, 190.74}},
                 {"5", 1769472, 216, {0, 8.15, 0, 24.05}},     {"5", 221184, 3456, {0, 4.94, 0, 21.81}},
                 {"5", 442368, 1728, {0, 4.94, 0, 20.59}},     {"5", 884736, 864, {0, 4.55, 0, 18.67}},
                 {"5", 1769472, 432, {0, 4.10, 0, 15.45}},     {"5", 3538944, 216, {0, 4.00, 0, 11.48}}};
    lam_status status = LAM_OK;
    table out = {.name = "answers",
                 .title = "Radiosity in frames a second (Fernández et al. 2011: tables 2 to 5)",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const double bytes = 4. * (double)cases[i].n * (double)cases[i].k;
        if (bytes > (run->scale == BENCH_QUICK ? 2e7 : run->scale == BENCH_DEFAULT ? 6e8 : 4e9)) continue;
        TRY(bench_check(run, error));
        TRY(add_answer(cases[i].source, cases[i].n, cases[i].k, cases[i].theirs, bytes < 1e9, &out, error));
    }
    TRY(bench_table(run, &out, error));
done:
    table_free(&out);
    return status;
}

lam_status lowrank_of_index_vector(const bench_run *run, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(products(run, error));
    TRY(answers(run, error));
done:
    return status;
}
