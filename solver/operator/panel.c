/* Owns the dense matrix of an operator: its memory, and its two products for the CPU at hand. */
#include "solver/operator/panel.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#if defined(__x86_64__)
#include <immintrin.h>
#endif

/* Rows whose products are added in single precision before they join the sum in double. */
#define PROJECT_BLOCK 128
/* Rows that go through project together. */
#define PROJECT_ROWS 8
/* Chunks of columns that a lane of expand adds before they join the sum in double. */
#define EXPAND_CHUNKS 128

#define HUGE_PAGE ((size_t)2 << 20)

struct panel_kernels {
    const char *name;
    void (*project)(size_t n_rows, const float *const *rows, const float *c, size_t m, size_t n_chunks,
                    float *t);
    void (*expand)(const panel *a, size_t m, const float *t, float *Y, size_t y_stride);
    void (*flush)(size_t count, float *restrict part, double *restrict total);
};

typedef float lane4 __attribute__((vector_size(16), may_alias));

#define KERNEL(name) name##_portable
#define TARGET
#define lane lane4
#define LANE_SET(x) ((lane4){(x), (x), (x), (x)})
#define LANE_FMA(a, b, c) ((a) * (b) + (c))
static inline float lane_sum_portable(lane4 x) {
    return (x[0] + x[2]) + (x[1] + x[3]);
}
#define ROW_TILE 2
#define VECTOR_TILE 1
#define PROJECT_TILE 2
#include "solver/operator/panel_kernels.h"

#if defined(__x86_64__)
#define KERNEL(name) name##_avx2
#define TARGET __attribute__((target("avx2,fma")))
#define lane __m256
#define LANE_SET(x) _mm256_set1_ps(x)
#define LANE_FMA(a, b, c) _mm256_fmadd_ps(a, b, c)
TARGET static inline float lane_sum_avx2(__m256 x) {
    __m128 four = _mm256_castps256_ps128(x) + _mm256_extractf128_ps(x, 1);
    __m128 two = four + _mm_movehl_ps(four, four);
    return _mm_cvtss_f32(two + _mm_movehdup_ps(two));
}
#define ROW_TILE 4
#define VECTOR_TILE 1
#define PROJECT_TILE 4
#include "solver/operator/panel_kernels.h"

#define KERNEL(name) name##_avx512
#define TARGET __attribute__((target("avx512f")))
#define lane __m512
#define LANE_SET(x) _mm512_set1_ps(x)
#define LANE_FMA(a, b, c) _mm512_fmadd_ps(a, b, c)
TARGET static inline float lane_sum_avx512(__m512 x) {
    __m256 eight =
        _mm512_castps512_ps256(x) + _mm256_castpd_ps(_mm512_extractf64x4_pd(_mm512_castps_pd(x), 1));
    __m128 four = _mm256_castps256_ps128(eight) + _mm256_extractf128_ps(eight, 1);
    __m128 two = four + _mm_movehl_ps(four, four);
    return _mm_cvtss_f32(two + _mm_movehdup_ps(two));
}
#define ROW_TILE 4
#define VECTOR_TILE 4
#define PROJECT_TILE 8
#include "solver/operator/panel_kernels.h"
#endif

static const panel_kernels kernels_portable = {"portable", project_portable, expand_portable, flush_portable};
#if defined(__x86_64__)
static const panel_kernels kernels_avx2 = {"avx2", project_avx2, expand_avx2, flush_avx2};
static const panel_kernels kernels_avx512 = {"avx512", project_avx512, expand_avx512, flush_avx512};
#endif

const panel_kernels *panel_kernels_available(size_t index) {
    const panel_kernels *available[3];
    size_t count = 0;
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx512f")) available[count++] = &kernels_avx512;
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) available[count++] = &kernels_avx2;
#endif
    available[count++] = &kernels_portable;
    return index < count ? available[index] : NULL;
}

const char *panel_kernels_name(const panel_kernels *kernels) {
    return kernels->name;
}

/* Zeroed memory for count floats, *data at a cache line in it, or in huge pages: with 4 KiB pages a solve
 * takes twice as long. NULL on failure. */
static void *allocate_floats(size_t count, const char *name, float **data, lam_error *error) {
    size_t align = count < 2 * HUGE_PAGE / sizeof(float) ? PANEL_ALIGN : HUGE_PAGE;
    char *memory = memory_allocate(count + align / sizeof(float), sizeof(float), name, error);
    if (memory == NULL) return NULL;
    char *aligned = memory + (align - (uintptr_t)memory % align) % align;
    /* Only advice: without it the result is the same, later. */
    if (align == HUGE_PAGE) (void)madvise(aligned, count * sizeof(float), MADV_HUGEPAGE);
    *data = (float *)aligned;
    return memory;
}

/* Whether all are finite; a sum of x - x is 0 then, else NaN. */
static bool all_finite(size_t count, const float *x) {
    float sum = 0.0f;
#pragma omp simd reduction(+ : sum)
    for (size_t j = 0; j < count; j++) sum += x[j] - x[j];
    return sum == 0.0f;
}

lam_status panel_create(size_t n, size_t k, const float *rows, const char *name, panel *a, lam_error *error) {
    lam_status status = LAM_OK;
    float *data = NULL;
    void *memory = NULL;
    size_t count, stride = k / PANEL_CHUNK * PANEL_CHUNK + (k % PANEL_CHUNK > 0 ? PANEL_CHUNK : 0);
    if (stride < k || !size_multiply(n, stride, &count) || count > PTRDIFF_MAX / sizeof(float))
        FAIL(error, LAM_ERR_MEMORY, "%s: %zu x %zu numbers are more than memory can have", name, n, k);
    memory = allocate_floats(count, name, &data, error);
    if (memory == NULL) {
        status = LAM_ERR_MEMORY;
        goto done;
    }
    for (size_t i = 0; i < n && k > 0; i++) {
        const float *row = rows + i * k;
        if (!all_finite(k, row)) {
            size_t j = 0;
            while (isfinite(row[j])) j++;
            FAIL(error, LAM_ERR_NUMERIC, "%s[%zu][%zu] = %g, must be finite", name, i, j, (double)row[j]);
        }
        memcpy(data + i * stride, row, k * sizeof *data);
    }
    *a = (panel){.n = n,
                 .k = k,
                 .stride = stride,
                 .data = data,
                 .memory = memory,
                 .kernels = panel_kernels_available(0)};
    memory = NULL;
done:
    free(memory);
    return status;
}

void panel_free(panel *a) {
    free(a->memory);
    *a = (panel){0};
}

void panel_copy_rows(const panel *a, float *rows) {
    for (size_t i = 0; i < a->n && a->k > 0; i++)
        memcpy(rows + i * a->k, a->data + i * a->stride, a->k * sizeof *rows);
}

size_t panel_bytes(const panel *a) {
    return a->n * a->stride * sizeof(float);
}

size_t panel_work_bytes(const panel *a, size_t m) {
    size_t count, total = 0;
    if (m > PANEL_VECTORS) m = PANEL_VECTORS;
    if (!size_multiply(a->stride, m, &count)) return 0;
    if (count > SIZE_MAX / sizeof(double) || !work_add(&total, count * sizeof(float)) ||
        !work_add(&total, count * sizeof(double)))
        return 0;
    return total > 0 ? total : PANEL_ALIGN;
}

/* The rows of a block where some vector is not 0: their numbers go to c, [rows found][m]. */
static size_t find_rows(const panel *a, size_t first, size_t last, size_t m, const float *X, size_t x_stride,
                        const float **rows, float *c) {
    size_t found = 0;
    for (size_t i = first; i < last; i++) {
        bool any = false;
        for (size_t v = 0; v < m; v++) {
            float x = X[v * x_stride + i];
            c[found * m + v] = x;
            any = any || x != 0.0f;
        }
        if (any) rows[found++] = a->data + i * a->stride;
    }
    return found;
}

static void project_pass(const panel *a, size_t m, const float *X, size_t x_stride, float *T, size_t t_stride,
                         void *work) {
    const float *rows[PROJECT_BLOCK];
    float c[PROJECT_BLOCK * PANEL_VECTORS];
    size_t n_chunks = a->stride / PANEL_CHUNK, count = a->stride * m;
    float *part = work_take(&work, count * sizeof *part);
    double *total = work_take(&work, count * sizeof *total);
    memset(part, 0, count * sizeof *part);
    memset(total, 0, count * sizeof *total);
    for (size_t first = 0; first < a->n; first += PROJECT_BLOCK) {
        size_t last = a->n - first < PROJECT_BLOCK ? a->n : first + PROJECT_BLOCK;
        size_t found = find_rows(a, first, last, m, X, x_stride, rows, c);
        for (size_t r = 0; r < found; r += PROJECT_ROWS) {
            size_t n_rows = found - r < PROJECT_ROWS ? found - r : PROJECT_ROWS;
            a->kernels->project(n_rows, rows + r, c + r * m, m, n_chunks, part);
        }
        if (found > 0) a->kernels->flush(count, part, total);
    }
    for (size_t v = 0; v < m; v++)
        for (size_t j = 0; j < a->k; j++)
            T[v * t_stride + j] = (float)total[(j / PANEL_CHUNK * m + v) * PANEL_CHUNK + j % PANEL_CHUNK];
}

static void expand_pass(const panel *a, size_t m, const float *T, size_t t_stride, float *Y, size_t y_stride,
                        void *work) {
    float *t = work_take(&work, a->stride * m * sizeof *t);
    for (size_t v = 0; v < m; v++)
        for (size_t j = 0; j < a->stride; j++)
            t[(j / PANEL_CHUNK * m + v) * PANEL_CHUNK + j % PANEL_CHUNK] =
                j < a->k ? T[v * t_stride + j] : 0.0f;
    a->kernels->expand(a, m, t, Y, y_stride);
}

void panel_project(const panel *a, size_t m, const float *X, size_t x_stride, float *T, size_t t_stride,
                   void *work) {
    for (size_t v = 0; v < m; v += PANEL_VECTORS)
        project_pass(a, m - v < PANEL_VECTORS ? m - v : PANEL_VECTORS, X + v * x_stride, x_stride,
                     T + v * t_stride, t_stride, work);
}

void panel_expand(const panel *a, size_t m, const float *T, size_t t_stride, float *Y, size_t y_stride,
                  void *work) {
    for (size_t v = 0; v < m; v += PANEL_VECTORS)
        expand_pass(a, m - v < PANEL_VECTORS ? m - v : PANEL_VECTORS, T + v * t_stride, t_stride,
                    Y + v * y_stride, y_stride, work);
}
