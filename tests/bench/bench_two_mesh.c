/* Tables 1 to 5 of Fernández et al. 2011 at their sizes, as CSV: their figures beside ours. Those of GPUs are
 * quoted; nothing ran on one.
 *
 *     bench_two_mesh product [N K]      V^T E by the index vector against a full V with OpenBLAS (table 1)
 *     bench_two_mesh radiosity [N K]    B~ of a stored operator (tables 3 to 5); 3.2 GB for the largest,
 *                                       twice that for a moment
 *
 * Medians. V has one 1 a row in runs of n/k, Y is made up: neither time depends on the numbers. The full V is
 * stored in both orders, and the faster product counts. OMP_NUM_THREADS sets the threads of the operator. */
#include "solver/clock.h"
#include "solver/operator/operator.h"
#include "solver/operator/segments.h"

#include <cblas.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { RUNS = 15 };

/* What a case is timed for, in all. */
static const double seconds_of_a_case = .6;

typedef struct product_case {
    size_t n, k;
    double theirs; /* full CPU / sparse CPU */
} product_case;

static const product_case products[] = {{3456, 216, 15.67},    {3456, 864, 68.33},  {13824, 216, 21.67},
                                        {3456, 3456, 75.75},   {13824, 864, 92.11}, {55296, 216, 17.42},
                                        {13824, 3456, 335.50}, {55296, 864, 94.03}, {221184, 216, 24.01}};

typedef struct radiosity_case {
    const char *table;
    size_t n, k;
    double cpu_full, cpu_sparse, gpu_full, gpu_sparse; /* their frames a second; 0: not given */
} radiosity_case;

static const radiosity_case radiosities[] = {
    {"3", 3456, 216, 814, 1591, 1556, 7000}, {"3", 3456, 864, 221, 372, 1014, 2414},
    {"3", 13824, 216, 196, 374, 395, 2059},  {"3", 3456, 3456, 70, 100, 278, 569},
    {"3", 13824, 864, 51, 96, 273, 933},     {"3", 55296, 216, 47, 90, 100, 504},
    {"3", 13824, 3456, 14, 24, 76, 275},     {"3", 55296, 864, 12, 23, 70, 252},
    {"3", 221184, 216, 11, 23, 23, 116},     {"4", 13824, 3456, 0, 74.07, 0, 297.87},
    {"4", 55296, 864, 0, 73.61, 0, 301.72},  {"4", 221184, 216, 0, 72.92, 0, 190.74},
    {"5.4", 24128, 1364, 0, 0, 0, 430},      {"5", 1769472, 216, 0, 8.15, 0, 24.05},
    {"5", 221184, 3456, 0, 4.94, 0, 21.81},  {"5", 442368, 1728, 0, 4.94, 0, 20.59},
    {"5", 884736, 864, 0, 4.55, 0, 18.67},   {"5", 1769472, 432, 0, 4.10, 0, 15.45},
    {"5", 3538944, 216, 0, 4.00, 0, 11.48}};

static void stop(const char *why) {
    fprintf(stderr, "bench_two_mesh: %s\n", why);
    exit(1);
}

static void *take(size_t count, size_t size) {
    void *memory = calloc(count, size);
    if (memory == NULL) stop("out of memory");
    return memory;
}

static int ascending(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Median seconds of one call: RUNS measurements of so many calls that each can be timed. */
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
    qsort(runs, RUNS, sizeof *runs, ascending);
    return runs[RUNS / 2];
}

/* Where runs of n/k begin; the caller owns it. */
static uint64_t *runs_of(size_t n, size_t k) {
    uint64_t *begin = take(k + 1, sizeof *begin);
    for (size_t p = 0; p <= k; p++) begin[p] = p * n / k;
    return begin;
}

/* --- V^T E ------------------------------------------------------------------------------------------------
 */

typedef struct product {
    size_t n, k;
    const float *V_rows, *V_columns, *E;
    float *t;
    segments sparse;
} product;

static void by_columns(void *context) { /* V is k columns of n */
    const product *p = context;
    cblas_sgemv(CblasColMajor, CblasTrans, (int)p->n, (int)p->k, 1, p->V_columns, (int)p->n, p->E, 1, 0, p->t,
                1);
}

static void by_rows(void *context) { /* V is n rows of k */
    const product *p = context;
    cblas_sgemv(CblasRowMajor, CblasTrans, (int)p->n, (int)p->k, 1, p->V_rows, (int)p->k, p->E, 1, 0, p->t,
                1);
}

static void by_index(void *context) {
    const product *p = context;
    segments_sum(&p->sparse, p->E, p->t);
}

static void run_product(const product_case *c) {
    const size_t n = c->n, k = c->k;
    float *V_rows = take(n * k, sizeof *V_rows), *V_columns = take(n * k, sizeof *V_columns);
    float *E = take(n, sizeof *E), *t = take(k, sizeof *t), *check = take(k, sizeof *check);
    double full[2];
    lam_error error = {0};
    product p = {.n = n, .k = k, .V_rows = V_rows, .V_columns = V_columns, .E = E, .t = t};
    for (size_t j = 0; j < n; j++) E[j] = (float)(1 + j % 7);
    if (segments_create(n, k, runs_of(n, k), NULL, &p.sparse, &error) != LAM_OK) stop(error.message);
    for (size_t q = 0; q < k; q++)
        for (uint64_t j = p.sparse.begin[q]; j < p.sparse.begin[q + 1]; j++)
            V_rows[j * k + q] = V_columns[q * n + j] = 1;
    by_index(&p);
    memcpy(check, t, k * sizeof *t);
    for (int threads = 1; threads <= 2; threads++) {
        openblas_set_num_threads(threads);
        full[threads - 1] = fmin(time_of(by_columns, &p), time_of(by_rows, &p));
        for (size_t q = 0; q < k; q++)
            if (fabsf(t[q] - check[q]) > 1e-4f * check[q]) stop("full and sparse V^T E differ");
    }
    const double sparse = time_of(by_index, &p);
    printf("1,%zu,%zu,%.2f,%.2f,%.3f,%.1f,%.1f,%.2f\n", n, k, 1e6 * full[0], 1e6 * full[1], 1e6 * sparse,
           full[0] / sparse, full[1] / sparse, c->theirs);
    fflush(stdout);
    segments_free(&p.sparse);
    free(V_rows);
    free(V_columns);
    free(E);
    free(t);
    free(check);
}

/* --- B~ ---------------------------------------------------------------------------------------------------
 */

typedef struct solve {
    const lam_operator *op;
    const float *E;
    float *B;
    void *work;
    size_t work_bytes;
} solve;

static void apply(void *context) {
    const solve *s = context;
    if (lam_operator_apply(s->op, 1, LAM_RADIOSITY, s->E, s->B, s->work, s->work_bytes, NULL) != LAM_OK)
        stop("apply failed");
}

static void run_radiosity(const radiosity_case *c) {
    const size_t n = c->n, k = c->k;
    float *reflectance = take(n, sizeof *reflectance), *E = take(n, sizeof *E), *B = take(n, sizeof *B);
    lam_operator *op = NULL;
    lam_error error = {0};
    two_mesh_arrays arrays = {.left = take(n * k, sizeof(float)), .begin = runs_of(n, k)};
    for (size_t i = 0; i < n * k; i++) arrays.left[i] = -1e-4f * (float)(1 + i % 13);
    for (size_t i = 0; i < n; i++) {
        reflectance[i] = .5f;
        E[i] = (float)(1 + i % 7);
    }
    if (operator_two_mesh_create(n, k, 1, reflectance, &arrays, &op, &error) != LAM_OK) stop(error.message);
    solve s = {.op = op, .E = E, .B = B, .work_bytes = lam_operator_work_bytes(op, 1)};
    s.work = take(s.work_bytes, 1);
    const double seconds = time_of(apply, &s);
    printf("%s,%zu,%zu,%.3f,%.1f,%.2f,%.4g,%.4g,%.4g,%.4g\n", c->table, n, k, 1e3 * seconds, 1 / seconds,
           1e-9 * (double)lam_operator_bytes(op) / seconds, c->cpu_full, c->cpu_sparse, c->gpu_full,
           c->gpu_sparse);
    fflush(stdout);
    lam_operator_close(op);
    free(s.work);
    free(reflectance);
    free(E);
    free(B);
}

int main(int argc, char **argv) {
    const bool of_product = argc > 1 && strcmp(argv[1], "product") == 0;
    if ((argc != 2 && argc != 4) || (!of_product && strcmp(argv[1], "radiosity") != 0)) {
        fprintf(stderr, "usage: bench_two_mesh product|radiosity [N K]\n");
        return 2;
    }
    const size_t n = argc == 4 ? strtoull(argv[2], NULL, 10) : 0,
                 k = argc == 4 ? strtoull(argv[3], NULL, 10) : 0;
    size_t ran = 0;
    if (of_product)
        puts("table,n,k,full_us_1_thread,full_us_2_threads,sparse_us,ratio_1_thread,ratio_2_threads,"
             "their_ratio");
    else
        puts("table,n,k,ms,fps,GB_per_s,their_cpu_full_fps,their_cpu_sparse_fps,their_gpu_full_fps_not_run,"
             "their_gpu_sparse_fps_not_run");
    for (size_t i = 0; of_product && i < sizeof products / sizeof *products; i++)
        if (n == 0 || (products[i].n == n && products[i].k == k)) {
            run_product(&products[i]);
            ran++;
        }
    for (size_t i = 0; !of_product && i < sizeof radiosities / sizeof *radiosities; i++)
        if (n == 0 || (radiosities[i].n == n && radiosities[i].k == k)) {
            run_radiosity(&radiosities[i]);
            ran++;
        }
    if (ran == 0) stop("the paper has no such size");
    return 0;
}
