/* Measures one answer of a low-rank operator: y = Y x for a Gaussian Y [n][k] in every precision, one to
 * 16 vectors at once, beside a plain read of Y and OpenBLAS's sgemv, taking turns in one run. Y is kept in
 * tiles in huge pages, and again as a daemon has it: in rows, in a file that is mapped.
 *
 *     bench_online [-r ROUNDS] [-d DIR | -a] [NxK ...]
 *
 * The file is made in DIR (/tmp); with -a the rows lie in huge pages too, which tells pages from layout.
 * CSV, times are medians. Ratios of one run are worth more than times: where sgemm_scaling, how much faster
 * OpenBLAS is with all threads, is far below their number, the machine was not free.
 */
#include "solver/base/clock.h"
#include "solver/base/random.h"
#include "solver/base/work_area.h"
#include "solver/bench/stats.h"
#include "solver/linalg/panel.h"

#include <cblas.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#define HUGE_PAGE ((size_t)2 << 20)

enum { BATCHES = 5, MOST_ROUNDS = 99, READ = 0, SGEMV = 1, FIRST_PRODUCT = 2 };
static const size_t batches[BATCHES] = {1, 2, 4, 8, 16};
/* read, sgemv, then expand and project of each layout, precision and batch. */
enum { EACH = PANEL_PRECISIONS * BATCHES, MEASURED = FIRST_PRODUCT + 2 * PANEL_LAYOUTS * EACH };

typedef struct subject {
    size_t n, k;
    float *rows; /* [n][k], in huge pages: what is read, and what OpenBLAS takes */
    panel Y[PANEL_LAYOUTS][PANEL_PRECISIONS];
    void *file[PANEL_PRECISIONS]; /* memory of the rows of the second layout */
    size_t file_bytes[PANEL_PRECISIONS];
    float *x, *y; /* 16 vectors of max(n, k) each */
    void *work;
} subject;

static uint64_t next_random(uint64_t *state) {
    return random_lcg(state) >> 33;
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

/* Memory for values: a file of folder, which nobody else sees, or (folder NULL) huge pages. */
static void *map_values(size_t bytes, const char *folder) {
    char path[4096];
    void *values = MAP_FAILED;
    if (folder == NULL) {
        values = mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        if (values != MAP_FAILED) (void)madvise(values, bytes, MADV_HUGEPAGE);
    } else {
        snprintf(path, sizeof path, "%s/bench_online_XXXXXX", folder);
        const int fd = mkstemp(path);
        if (fd < 0) die("the folder cannot be written to");
        unlink(path);
        if (ftruncate(fd, (off_t)bytes) == 0)
            values = mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
        close(fd);
    }
    if (values == MAP_FAILED) die("values cannot be mapped");
    return values;
}

/* The same numbers once more, in rows. */
static void make_rows(subject *s, int p, const char *folder) {
    lam_error error = {0};
    const panel *tiles = &s->Y[PANEL_TILES][p];
    s->file_bytes[p] = s->n * s->k * panel_value_size((panel_precision)p) + PANEL_SLACK;
    s->file[p] = map_values(s->file_bytes[p], folder);
    panel_copy_values(tiles, s->file[p]);
    if (panel_view(s->n, s->k, (panel_precision)p, s->file[p], tiles->scale, "Y", &s->Y[PANEL_ROWS][p],
                   &error) != LAM_OK)
        die(error.message);
}

static void make_subject(subject *s, const char *folder) {
    lam_error error = {0};
    const size_t longest = s->n > s->k ? s->n : s->k;
    const size_t bytes_of_rows = (s->n * s->k * sizeof(float) + HUGE_PAGE) / HUGE_PAGE * HUGE_PAGE;
    float *rows = aligned_alloc(HUGE_PAGE, bytes_of_rows);
    if (rows == NULL) die("not enough memory");
    (void)madvise(rows, bytes_of_rows, MADV_HUGEPAGE);
    s->rows = rows;
#pragma omp parallel for
    for (size_t i = 0; i < s->n; i++) {
        uint64_t state = i * RANDOM_STEP + 1;
        for (size_t j = 0; j < s->k; j++) rows[i * s->k + j] = gaussian(&state);
    }
    panel *tiles = s->Y[PANEL_TILES];
    if (panel_create(s->n, s->k, rows, "Y", &tiles[0], &error) != LAM_OK) die(error.message);
    for (int p = 1; p < PANEL_PRECISIONS; p++)
        if (panel_convert(&tiles[0], (panel_precision)p, "Y", &tiles[p], &error) != LAM_OK)
            die(error.message);
    size_t work_bytes = 0;
    for (int p = 0; p < PANEL_PRECISIONS; p++) {
        make_rows(s, p, folder);
        tiles[p].n_threads = (size_t)omp_get_num_procs();
        const size_t bytes = panel_work_bytes(&tiles[p], PANEL_VECTORS);
        if (bytes > work_bytes) work_bytes = bytes;
    }
    s->x = aligned_alloc(WORK_AREA_ALIGN, longest * PANEL_VECTORS * sizeof *s->x);
    s->y = aligned_alloc(WORK_AREA_ALIGN, longest * PANEL_VECTORS * sizeof *s->y);
    s->work = aligned_alloc(WORK_AREA_ALIGN, work_bytes);
    if (s->x == NULL || s->y == NULL || s->work == NULL) die("not enough memory");
    uint64_t state = 1;
    for (size_t i = 0; i < longest * PANEL_VECTORS; i++) s->x[i] = gaussian(&state);
    memset(s->y, 0, longest * PANEL_VECTORS * sizeof *s->y);
    memset(s->work, 0, work_bytes);
}

static void free_subject(subject *s) {
    for (int p = 0; p < PANEL_PRECISIONS; p++) {
        panel_free(&s->Y[PANEL_TILES][p]);
        panel_free(&s->Y[PANEL_ROWS][p]);
        munmap(s->file[p], s->file_bytes[p]);
    }
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

typedef struct subject_product {
    bool expand;
    int layout, precision, batch;
} subject_product;

static subject_product product_of(int which) {
    const int product = which - FIRST_PRODUCT;
    return (subject_product){.expand = product < PANEL_LAYOUTS * EACH,
                             .layout = product / EACH % PANEL_LAYOUTS,
                             .precision = product / BATCHES % PANEL_PRECISIONS,
                             .batch = product % BATCHES};
}

static double measure(subject *s, int which, int n_threads) {
    double start = clock_seconds();
    if (which == READ) {
        kept = read_all(s, n_threads);
    } else if (which == SGEMV) {
        cblas_sgemv(CblasRowMajor, CblasNoTrans, (int)s->n, (int)s->k, 1, s->rows, (int)s->k, s->x, 1, 0,
                    s->y, 1);
    } else {
        const subject_product of = product_of(which);
        panel *Y = &s->Y[of.layout][of.precision];
        Y->n_threads = (size_t)n_threads;
        if (of.expand)
            panel_expand(Y, batches[of.batch], s->x, s->k, s->y, s->n, s->work);
        else
            panel_project(Y, batches[of.batch], s->x, s->n, s->y, s->k, s->work);
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
    static const char *const layouts[PANEL_LAYOUTS] = {"tiles", "mapped"};
    const double plain = (double)(s->n * s->k * sizeof(float));
    for (int which = 0; which < FIRST_PRODUCT; which++)
        printf("%zu,%zu,%d,%s,rows,f32,1,%.3f,%.2f,%.2f,%.2f,1,1,1,%.2f\n", s->n, s->k, n_threads,
               which == READ ? "read" : "sgemv", seconds[which] * 1e3, plain / seconds[which] * 1e-9,
               seconds[READ] / seconds[which], seconds[SGEMV] / seconds[which], scaling);
    for (int which = FIRST_PRODUCT; which < MEASURED; which++) {
        const subject_product of = product_of(which);
        const panel *a = &s->Y[of.layout][of.precision];
        printf("%zu,%zu,%d,%s,%s,%s,%zu,%.3f,%.2f,%.2f,%.2f,%.2f,%.3f,%.2f,%.2f\n", s->n, s->k, n_threads,
               of.expand ? "expand" : "project", layouts[of.layout], panel_precision_name(a->precision),
               batches[of.batch], seconds[which] * 1e3, (double)panel_bytes(a) / seconds[which] * 1e-9,
               seconds[READ] / seconds[which], seconds[SGEMV] / seconds[which],
               seconds[which - of.precision * BATCHES] / seconds[which],
               seconds[which] / (double)batches[of.batch] / seconds[which - of.batch],
               seconds[which - of.layout * EACH] / seconds[which], scaling);
    }
}

static void bench(size_t n, size_t k, int n_rounds, const char *folder, double scaling) {
    static double times[2][MEASURED][MOST_ROUNDS];
    double median[MEASURED];
    subject s = {.n = n, .k = k};
    const int n_procs = omp_get_num_procs();
    make_subject(&s, folder);
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
    const char *folder = "/tmp";
    for (int option; (option = getopt(argc, argv, "r:d:a")) != -1; first = optind) {
        if (option == '?') die("[-r ROUNDS] [-d DIR | -a] [NxK ...]");
        if (option == 'r') n_rounds = atoi(optarg);
        if (option == 'd') folder = optarg;
        if (option == 'a') folder = NULL;
    }
    if (n_rounds < 1 || n_rounds > MOST_ROUNDS) die("-r: 1 to 99 rounds");
    const double scaling = sgemm_seconds(1) / sgemm_seconds(omp_get_num_procs());
    puts("n,k,threads,what,layout,precision,vectors,ms,gb_per_s,speed_of_read,speed_of_sgemv,speed_of_f32,"
         "time_per_vector_of_single,speed_of_tiles,sgemm_scaling");
    for (int i = first; i < argc; i++) {
        size_t n, k;
        if (sscanf(argv[i], "%zux%zu", &n, &k) != 2 || n == 0 || k == 0) die("sizes are given as NxK");
        bench(n, k, n_rounds, folder, scaling);
    }
    for (size_t i = 0; first == argc && i < sizeof sizes / sizeof sizes[0]; i++)
        bench(sizes[i][0], sizes[i][1], n_rounds, folder, scaling);
    return 0;
}
