#include "solver/operator/sliced.h"

#include <stdlib.h>
#include <string.h>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

/* Longer rows are multiplied one by one; slices at a time for a thread; work below which there is but one. */
enum { SHORT = 96, SLICES_AT_ONCE = 64, THREADS_WORTH = 100000 };

void sliced_free(sliced_rows *s) {
    free(s->slices);
    free(s->slice_of);
    free(s->long_rows);
    free(s->empty_rows);
    free(s->indices);
    free(s->data);
    *s = (sliced_rows){.n_slices = 0};
}

static size_t length_of(const csr *a, size_t i) {
    return (size_t)(a->indptr[i + 1] - a->indptr[i]);
}

/* Rows by length, in their order where that is the same: begin[l] is where those of length l begin. */
static void sort_rows(const csr *a, uint32_t *sorted, size_t begin[SHORT + 2]) {
    memset(begin, 0, (SHORT + 2) * sizeof *begin);
    for (size_t i = 0; i < a->n; i++)
        if (length_of(a, i) <= SHORT) begin[length_of(a, i) + 1]++;
    for (size_t l = 0; l <= SHORT; l++) begin[l + 1] += begin[l];
    size_t next[SHORT + 1];
    memcpy(next, begin, sizeof next);
    for (size_t i = 0; i < a->n; i++)
        if (length_of(a, i) <= SHORT) sorted[next[length_of(a, i)]++] = (uint32_t)i;
}

static void fill_slice(const csr *a, const uint32_t *rows, size_t count, sliced_rows *s, slice *to) {
    for (size_t lane = 0; lane < SLICE_ROWS; lane++) {
        const uint32_t i = rows[lane < count ? lane : count - 1];
        const uint64_t from = a->indptr[i];
        to->row[lane] = i;
        for (size_t k = 0; k < to->length; k++) {
            s->indices[to->begin + k * SLICE_ROWS + lane] = a->indices[from + k];
            s->data[to->begin + k * SLICE_ROWS + lane] = a->data[from + k];
        }
    }
}

lam_status sliced_create(const csr *a, sliced_rows *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = a->n;
    size_t begin[SHORT + 2], entries = 0, n_slices = 0;
    sliced_rows made = {.all = a};
    uint32_t *sorted = memory_allocate(n, sizeof *sorted, "operator", error);
    if (sorted == NULL) TRY(LAM_ERR_MEMORY);
    sort_rows(a, sorted, begin);
    for (size_t l = 1; l <= SHORT; l++) {
        const size_t slices = (begin[l + 1] - begin[l] + SLICE_ROWS - 1) / SLICE_ROWS;
        n_slices += slices;
        entries += slices * l * SLICE_ROWS;
    }
    made.slices = memory_allocate(n_slices, sizeof *made.slices, "operator", error);
    made.slice_of = memory_allocate(n, sizeof *made.slice_of, "operator", error);
    made.long_rows = memory_allocate(n - begin[SHORT + 1], sizeof *made.long_rows, "operator", error);
    made.empty_rows = memory_allocate(begin[1], sizeof *made.empty_rows, "operator", error);
    made.indices = memory_allocate(entries, sizeof *made.indices, "operator", error);
    made.data = memory_allocate(entries, sizeof *made.data, "operator", error);
    if (made.slices == NULL || made.slice_of == NULL || made.long_rows == NULL || made.empty_rows == NULL ||
        made.indices == NULL || made.data == NULL)
        TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) made.slice_of[i] = SLICE_NONE;
    for (size_t i = 0; i < n; i++)
        if (length_of(a, i) > SHORT) made.long_rows[made.n_long++] = (uint32_t)i;
    made.n_empty = begin[1];
    memcpy(made.empty_rows, sorted, begin[1] * sizeof *sorted);
    uint64_t used = 0;
    for (size_t l = 1; l <= SHORT; l++)
        for (size_t k = begin[l]; k < begin[l + 1]; k += SLICE_ROWS) {
            const size_t count = begin[l + 1] - k < SLICE_ROWS ? begin[l + 1] - k : SLICE_ROWS;
            slice *to = &made.slices[made.n_slices++];
            *to = (slice){.begin = used, .length = (uint32_t)l};
            fill_slice(a, sorted + k, count, &made, to);
            for (size_t r = 0; r < count; r++) made.slice_of[sorted[k + r]] = (uint32_t)made.n_slices - 1;
            used += l * SLICE_ROWS;
        }
    *out = made;
    made = (sliced_rows){.n_slices = 0};
done:
    free(sorted);
    sliced_free(&made);
    return status;
}

/* Sums that take turns, in pairs that are the same wherever they were made. */
static float sum_of_turns(float turns[SLICE_ROWS]) {
    for (size_t half = SLICE_ROWS / 2; half > 0; half /= 2)
        for (size_t l = 0; l < half; l++) turns[l] += turns[l + half];
    return turns[0];
}

/* --- one vector: a lane for each row -------------------------------------------------------------------- */

typedef void multiply_slices(const sliced_rows *s, size_t first, size_t last, const float *x, float *y);

/* A long row: sixteen sums take turns. */
typedef float multiply_long(const uint32_t *indices, const float *data, size_t count, const float *x);

static float long_portable(const uint32_t *indices, const float *data, size_t count, const float *x) {
    float turns[SLICE_ROWS] = {0};
    for (size_t e = 0; e < count; e++) turns[e % SLICE_ROWS] += data[e] * x[indices[e]];
    return sum_of_turns(turns);
}

static void slices_portable(const sliced_rows *s, size_t first, size_t last, const float *x, float *y) {
    for (size_t k = first; k < last; k++) {
        const slice *t = &s->slices[k];
        float sums[SLICE_ROWS] = {0};
        for (size_t e = 0; e < t->length; e++)
            for (size_t lane = 0; lane < SLICE_ROWS; lane++) {
                const uint64_t at = t->begin + e * SLICE_ROWS + lane;
                sums[lane] += s->data[at] * x[s->indices[at]];
            }
        for (size_t lane = 0; lane < SLICE_ROWS; lane++) y[t->row[lane]] = sums[lane];
    }
}

#if defined(__x86_64__)
__attribute__((target("avx2,fma"))) static void slices_avx2(const sliced_rows *s, size_t first, size_t last,
                                                            const float *x, float *y) {
    for (size_t k = first; k < last; k++) {
        const slice *t = &s->slices[k];
        __m256 low = _mm256_setzero_ps(), high = low;
        float sums[SLICE_ROWS];
        for (size_t e = 0; e < t->length; e++) {
            const uint64_t at = t->begin + e * SLICE_ROWS;
            const __m256i j = _mm256_loadu_si256((const __m256i *)(const void *)(s->indices + at));
            const __m256i l = _mm256_loadu_si256((const __m256i *)(const void *)(s->indices + at + 8));
            low = _mm256_fmadd_ps(_mm256_loadu_ps(s->data + at), _mm256_i32gather_ps(x, j, 4), low);
            high = _mm256_fmadd_ps(_mm256_loadu_ps(s->data + at + 8), _mm256_i32gather_ps(x, l, 4), high);
        }
        _mm256_storeu_ps(sums, low);
        _mm256_storeu_ps(sums + 8, high);
        for (size_t lane = 0; lane < SLICE_ROWS; lane++) y[t->row[lane]] = sums[lane];
    }
}

__attribute__((target("avx2,fma"))) static float long_avx2(const uint32_t *indices, const float *data,
                                                           size_t count, const float *x) {
    __m256 low = _mm256_setzero_ps(), high = low;
    float turns[SLICE_ROWS];
    size_t e = 0;
    for (; e + SLICE_ROWS <= count; e += SLICE_ROWS) {
        const __m256i j = _mm256_loadu_si256((const __m256i *)(const void *)(indices + e));
        const __m256i l = _mm256_loadu_si256((const __m256i *)(const void *)(indices + e + 8));
        low = _mm256_fmadd_ps(_mm256_loadu_ps(data + e), _mm256_i32gather_ps(x, j, 4), low);
        high = _mm256_fmadd_ps(_mm256_loadu_ps(data + e + 8), _mm256_i32gather_ps(x, l, 4), high);
    }
    _mm256_storeu_ps(turns, low);
    _mm256_storeu_ps(turns + 8, high);
    for (size_t k = 0; e < count; e++, k++) turns[k] = __builtin_fmaf(data[e], x[indices[e]], turns[k]);
    return sum_of_turns(turns);
}

__attribute__((target("avx512f,fma"))) static float long_avx512(const uint32_t *indices, const float *data,
                                                                size_t count, const float *x) {
    __m512 sum = _mm512_setzero_ps();
    float turns[SLICE_ROWS];
    size_t e = 0;
    for (; e + SLICE_ROWS <= count; e += SLICE_ROWS)
        sum = _mm512_fmadd_ps(_mm512_loadu_ps(data + e),
                              _mm512_i32gather_ps(_mm512_loadu_si512(indices + e), x, 4), sum);
    _mm512_storeu_ps(turns, sum);
    for (size_t k = 0; e < count; e++, k++) turns[k] = __builtin_fmaf(data[e], x[indices[e]], turns[k]);
    return sum_of_turns(turns);
}

__attribute__((target("avx512f,fma"))) static void slices_avx512(const sliced_rows *s, size_t first,
                                                                 size_t last, const float *x, float *y) {
    for (size_t k = first; k < last; k++) {
        const slice *t = &s->slices[k];
        __m512 sum = _mm512_setzero_ps();
        for (size_t e = 0; e < t->length; e++) {
            const uint64_t at = t->begin + e * SLICE_ROWS;
            const __m512i j = _mm512_loadu_si512(s->indices + at);
            sum = _mm512_fmadd_ps(_mm512_loadu_ps(s->data + at), _mm512_i32gather_ps(j, x, 4), sum);
        }
        _mm512_i32scatter_ps(y, _mm512_loadu_si512(t->row), sum, 4);
    }
}
#endif

/* --- several: a lane for each vector ---------------------------------------------------------------------
 */

enum { WIDTH = 16 };

typedef void multiply_wide(const sliced_rows *s, size_t first, size_t last, size_t m, const float *side,
                           float *Y);
typedef void multiply_long_wide(const uint32_t *indices, const float *data, size_t count, const float *side,
                                float *sums);

#define KERNEL(name) name##_portable
#define TARGET
#define SCALAR_FMA(a, b, c) ((c) + (a) * (b))
#include "solver/operator/sliced_wide.h"

#if defined(__x86_64__)
#define KERNEL(name) name##_avx2
#define TARGET __attribute__((target("avx2,fma")))
#define SCALAR_FMA(a, b, c) __builtin_fmaf(a, b, c)
#include "solver/operator/sliced_wide.h"

#define KERNEL(name) name##_avx512
#define TARGET __attribute__((target("avx512f,fma")))
#define SCALAR_FMA(a, b, c) __builtin_fmaf(a, b, c)
#include "solver/operator/sliced_wide.h"
#endif

/* --- all of it -------------------------------------------------------------------------------------------
 */

typedef struct kernels {
    multiply_slices *one;
    multiply_long *one_long;
    multiply_wide *wide;
    multiply_long_wide *wide_long;
} kernels;

static kernels kernels_of_cpu(void) {
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
        const bool avx512 = __builtin_cpu_supports("avx512f");
        return (kernels){avx512 ? slices_avx512 : slices_avx2, avx512 ? long_avx512 : long_avx2,
                         avx512 ? wide_avx512 : wide_avx2, avx512 ? wide_long_avx512 : wide_long_avx2};
    }
#endif
    return (kernels){slices_portable, long_portable, wide_portable, wide_long_portable};
}

size_t sliced_work(size_t n, size_t m) {
    return m > 1 ? n * WIDTH : 0;
}

void sliced_multiply(const sliced_rows *s, size_t m, const float *X, float *Y, float *work,
                     size_t n_threads) {
    const kernels run = kernels_of_cpu();
    const csr *a = s->all;
    const size_t n = a->n;
    const float *x = m > 1 ? work : X;
    const bool many = n_threads > 1 && a->indptr[n] * m > THREADS_WORTH;
#pragma omp parallel num_threads((int)n_threads) if (many)
    {
        if (m > 1)
#pragma omp for schedule(static)
            for (size_t p = 0; p < n; p++)
                for (size_t v = 0; v < WIDTH; v++) work[p * WIDTH + v] = v < m ? X[v * n + p] : 0;
#pragma omp for schedule(dynamic, 4) nowait
        for (size_t k = 0; k < s->n_long; k++) {
            const uint32_t i = s->long_rows[k];
            const uint64_t first = a->indptr[i];
            const size_t count = length_of(a, i);
            float sums[WIDTH];
            if (m > 1)
                run.wide_long(a->indices + first, a->data + first, count, x, sums);
            else
                sums[0] = run.one_long(a->indices + first, a->data + first, count, x);
            for (size_t v = 0; v < m; v++) Y[v * n + i] = sums[v];
        }
#pragma omp for schedule(dynamic, 1) nowait
        for (size_t first = 0; first < s->n_slices; first += SLICES_AT_ONCE) {
            const size_t last = first + SLICES_AT_ONCE < s->n_slices ? first + SLICES_AT_ONCE : s->n_slices;
            if (m > 1)
                run.wide(s, first, last, m, x, Y);
            else
                run.one(s, first, last, x, Y);
        }
#pragma omp for schedule(static)
        for (size_t k = 0; k < s->n_empty; k++)
            for (size_t v = 0; v < m; v++) Y[v * n + s->empty_rows[k]] = 0;
    }
}

void sliced_multiply_rows(const sliced_rows *s, size_t count, const uint32_t *rows, const float *x,
                          float *y) {
    const kernels run = kernels_of_cpu();
    const csr *a = s->all;
    for (size_t k = 0; k < count; k++) {
        const uint32_t i = rows[k];
        const uint64_t first = a->indptr[i];
        const size_t length = length_of(a, i);
        if (s->slice_of[i] != SLICE_NONE)
            run.one(s, s->slice_of[i], s->slice_of[i] + 1, x, y);
        else
            y[i] = length > 0 ? run.one_long(a->indices + first, a->data + first, length, x) : 0;
    }
}
