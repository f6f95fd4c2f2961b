/* How fast one answer of a low-rank operator is: y = Y x for a Gaussian Y [n][k] in every precision, one to
 * 16 vectors at once, beside a plain read of Y and OpenBLAS's sgemv, taking turns in one run.
 *
 *     bench_online [-r ROUNDS] [NxK ...]
 *
 * CSV, times are medians. Ratios of one run are worth more than times: where sgemm_scaling, how much faster
 * OpenBLAS is with all threads, is far below their number, the machine was not free.
 */
#include "solver/bench/stats.h"
#include "solver/clock.h"
#include "solver/operator/panel.h"

#include <cblas.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#define HUGE_PAGE ((size_t)2 << 20)

enum { BATCHES = 5, MOST_ROUNDS = 99, READ = 0, SGEMV = 1, FIRST_PRODUCT = 2 };
static const size_t batches[BATCHES] = {1, 2, 4, 8, 16};
/* read, sgemv, then expand and project of each precision and batch. */
enum { MEASURED = FIRST_PRODUCT + 2 * PANEL_PRECISIONS * BATCHES };

typedef struct subject {
    size_t n, k;
    float *rows; /* [n][k], in huge pages: what is read, and what OpenBLAS takes */
    panel Y[PANEL_PRECISIONS];
    float *x, *y; /* 16 vectors of max(n, k) each */
    void *work;
} subject;

static uint64_t next_random(uint64_t *state) {
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return *state >> 33;
}

/* The sum of 4 uniform numbers, of variance 1: close enough to a Gaussian one. */
static float gaussian(uint64_t *state) {
    const uint64_t a = next_random(state), b = next_random(state);
    const double sum =
        (double)(a & 0x7fff) + (double)(a >> 15 & 0x7fff) + (double)(b & 0x7fff) + (double)(b >> 15 & 0x7fff);
    return (float)((sum * 0x1p-15 - 2) * 1.7320508);
}

static void die(const char *what) {
    fprintf(stderr, "bench_online: %s\n", what);
    exit(1);
}

static void make_subject(subject *s) {
    lam_error error = {0};
    const size_t longest = s->n > s->k ? s->n : s->k;
    const size_t bytes_of_rows = (s->n * s->k * sizeof(float) + HUGE_PAGE) / HUGE_PAGE * HUGE_PAGE;
    float *rows = aligned_alloc(HUGE_PAGE, bytes_of_rows);
    if (rows == NULL) die("not enough memory");
    (void)madvise(rows, bytes_of_rows, MADV_HUGEPAGE);
    s->rows = rows;
#pragma omp parallel for
    for (size_t i = 0; i < s->n; i++) {
        uint64_t state = i * 0x9E3779B97F4A7C15u + 1;
        for (size_t j = 0; j < s->k; j++) rows[i * s->k + j] = gaussian(&state);
    }
    if (panel_create(s->n, s->k, rows, "Y", &s->Y[0], &error) != LAM_OK) die(error.message);
    for (int p = 1; p < PANEL_PRECISIONS; p++)
        if (panel_convert(&s->Y[0], (panel_precision)p, "Y", &s->Y[p], &error) != LAM_OK) die(error.message);
    size_t work_bytes = 0;
    for (int p = 0; p < PANEL_PRECISIONS; p++) {
        s->Y[p].n_threads = (size_t)omp_get_num_procs();
        const size_t bytes = panel_work_bytes(&s->Y[p], PANEL_VECTORS);
        if (bytes > work_bytes) work_bytes = bytes;
    }
    s->x = aligned_alloc(PANEL_ALIGN, longest * PANEL_VECTORS * sizeof *s->x);
    s->y = aligned_alloc(PANEL_ALIGN, longest * PANEL_VECTORS * sizeof *s->y);
    s->work = aligned_alloc(PANEL_ALIGN, work_bytes);
    if (s->x == NULL || s->y == NULL || s->work == NULL) die("not enough memory");
    uint64_t state = 1;
    for (size_t i = 0; i < longest * PANEL_VECTORS; i++) s->x[i] = gaussian(&state);
    memset(s->y, 0, longest * PANEL_VECTORS * sizeof *s->y);
    memset(s->work, 0, work_bytes);
}

static void free_subject(subject *s) {
    for (int p = 0; p < PANEL_PRECISIONS; p++) panel_free(&s->Y[p]);
    free(s->rows);
    free(s->x);
    free(s->y);
    free(s->work);
}

/* All of x, each thread its share. */
#if defined(__x86_64__) && !defined(__clang__)
__attribute__((target_clones("avx512f", "avx2", "default")))
#endif
static float
sum_floats(const float *x, size_t count) {
    float sum[64] = {0}, total = 0;
    for (size_t i = 0; i + 64 <= count; i += 64)
#pragma omp simd
        for (size_t l = 0; l < 64; l++) sum[l] += x[i + l];
    for (size_t l = 0; l < 64; l++) total += sum[l];
    return total;
}

static float read_all(const subject *s, int n_threads) {
    const size_t count = s->n * s->k / 64 * 64;
    float total = 0;
#pragma omp parallel for reduction(+ : total) num_threads(n_threads)
    for (int t = 0; t < n_threads; t++) {
        const size_t first = count / 64 / (size_t)n_threads * 64 * (size_t)t;
        const size_t last = t + 1 == n_threads ? count : first + count / 64 / (size_t)n_threads * 64;
        total += sum_floats(s->rows + first, last - first);
    }
    return total;
}

static volatile float kept; /* so that no sum is left out */

static double measure(subject *s, int which, int n_threads) {
    double start = clock_seconds();
    if (which == READ) {
        kept = read_all(s, n_threads);
    } else if (which == SGEMV) {
        cblas_sgemv(CblasRowMajor, CblasNoTrans, (int)s->n, (int)s->k, 1, s->rows, (int)s->k, s->x, 1, 0,
                    s->y, 1);
    } else {
        const int product = which - FIRST_PRODUCT, batch = product % BATCHES, p = product / BATCHES;
        panel *Y = &s->Y[p % PANEL_PRECISIONS];
        Y->n_threads = (size_t)n_threads;
        if (p < PANEL_PRECISIONS)
            panel_expand(Y, batches[batch], s->x, s->k, s->y, s->n, s->work);
        else
            panel_project(Y, batches[batch], s->x, s->n, s->y, s->k, s->work);
    }
    return clock_seconds() - start;
}

static double sgemm_seconds(int n_threads) {
    enum { N = 1536 };
    float *A = malloc((size_t)3 * N * N * sizeof *A);
    double times[5];
    if (A == NULL) die("not enough memory");
    for (size_t i = 0; i < (size_t)3 * N * N; i++) A[i] = (float)(i % 7) - 3;
    openblas_set_num_threads(n_threads);
    for (int r = 0; r < 5; r++) {
        const double start = clock_seconds();
        cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, N, N, N, 1, A, N, A + N * N, N, 0,
                    A + 2 * N * N, N);
        times[r] = clock_seconds() - start;
    }
    free(A);
    return stats_median(times, 5);
}

static void print_lines(const subject *s, int n_threads, const double *seconds, double scaling) {
    for (int which = 0; which < MEASURED; which++) {
        const int product = which - FIRST_PRODUCT, batch = product % BATCHES, p = product / BATCHES;
        const size_t m = which < FIRST_PRODUCT ? 1 : batches[batch];
        const panel *a = &s->Y[which < FIRST_PRODUCT ? 0 : p % PANEL_PRECISIONS];
        const double single = which < FIRST_PRODUCT ? seconds[which] : seconds[which - batch];
        const double f32 =
            seconds[which < FIRST_PRODUCT  ? FIRST_PRODUCT
                    : p < PANEL_PRECISIONS ? FIRST_PRODUCT + batch
                                           : FIRST_PRODUCT + PANEL_PRECISIONS * BATCHES + batch];
        const char *name = which == READ          ? "read"
                           : which == SGEMV       ? "sgemv"
                           : p < PANEL_PRECISIONS ? "expand"
                                                  : "project";
        printf("%zu,%zu,%d,%s,%s,%zu,%.3f,%.2f,%.2f,%.2f,%.2f,%.3f,%.2f\n", s->n, s->k, n_threads, name,
               panel_precision_name(a->precision), m, seconds[which] * 1e3,
               (double)panel_bytes(a) / seconds[which] * 1e-9, seconds[READ] / seconds[which],
               seconds[SGEMV] / seconds[which], f32 / seconds[which], seconds[which] / (double)m / single,
               scaling);
    }
}

static void bench(size_t n, size_t k, int n_rounds, double scaling) {
    static double times[2][MEASURED][MOST_ROUNDS];
    double median[MEASURED];
    subject s = {.n = n, .k = k};
    const int n_procs = omp_get_num_procs();
    make_subject(&s);
    for (int r = -1; r < n_rounds; r++) /* the first to get warm */
        for (int t = 0; t < 2; t++) {
            const int n_threads = t == 0 ? 1 : n_procs;
            openblas_set_num_threads(n_threads);
            for (int which = 0; which < MEASURED; which++)
                times[t][which][r < 0 ? 0 : r] = measure(&s, which, n_threads);
        }
    for (int t = 0; t < 2; t++) {
        for (int which = 0; which < MEASURED; which++)
            median[which] = stats_median(times[t][which], (size_t)n_rounds);
        print_lines(&s, t == 0 ? 1 : n_procs, median, scaling);
        fflush(stdout);
    }
    free_subject(&s);
}

int main(int argc, char **argv) {
    static const size_t sizes[][2] = {{24128, 1364}, {79232, 1751}, {221184, 3456}, {3538944, 216}};
    int n_rounds = 7, first = 1;
    if (argc > 2 && strcmp(argv[1], "-r") == 0) {
        n_rounds = atoi(argv[2]);
        first = 3;
    }
    if (n_rounds < 1 || n_rounds > MOST_ROUNDS) die("-r: 1 to 99 rounds");
    const double scaling = sgemm_seconds(1) / sgemm_seconds(omp_get_num_procs());
    puts("n,k,threads,what,precision,vectors,ms,gb_per_s,speed_of_read,speed_of_sgemv,speed_of_f32,"
         "time_per_vector_of_single,sgemm_scaling");
    for (int i = first; i < argc; i++) {
        size_t n, k;
        if (sscanf(argv[i], "%zux%zu", &n, &k) != 2 || n == 0 || k == 0) die("sizes are given as NxK");
        bench(n, k, n_rounds, scaling);
    }
    for (size_t i = 0; first == argc && i < sizeof sizes / sizeof sizes[0]; i++)
        bench(sizes[i][0], sizes[i][1], n_rounds, scaling);
    return 0;
}
