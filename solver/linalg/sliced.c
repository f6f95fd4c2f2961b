#include "solver/linalg/sliced.h"

#include "solver/base/cpu.h"
#include "solver/base/half.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#ifdef CPU_AVX2_TARGET
#include <immintrin.h>
#endif

/* The longest row of a slice; slices that a thread takes at a time; multiplications below which one thread
 * works. */
enum { SHORT = 96, SLICES_AT_ONCE = 64, THREADS_WORTH = 100000 };

void sliced_free(sliced_rows *s) {
    free(s->slices);
    free(s->slice_of);
    free(s->long_rows);
    free(s->empty_rows);
    free(s->long_begin);
    free(s->indices);
    free(s->data);
    free(s->half_indices);
    free(s->halves);
    *s = (sliced_rows){.n_slices = 0};
}

static size_t length_of(const csr *a, size_t i) {
    return (size_t)(a->indptr[i + 1] - a->indptr[i]);
}

/* Sorts rows by length, stably: those of length l begin at begin[l]. */
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

/* True when every value is scale, a power of two, times an f16, and indices fit into 16 bits. */
static bool fits_halves(const csr *a, float scale) {
    int exponent;
    if (a->n > UINT16_MAX + (size_t)1 || !(scale > 0) || frexpf(scale, &exponent) != .5f) return false;
    for (uint64_t e = 0; e < a->indptr[a->n]; e++)
        if (scale * float_of_half(half_of_float(a->data[e] / scale)) != a->data[e]) return false;
    return true;
}

/* Copies entry `from` of all to entry `to`. */
static void put(sliced_rows *s, uint64_t to, uint64_t from) {
    if (s->halves != NULL) {
        s->half_indices[to] = (uint16_t)s->all->indices[from];
        s->halves[to] = half_of_float(s->all->data[from] / s->scale);
    } else {
        s->indices[to] = s->all->indices[from];
        s->data[to] = s->all->data[from];
    }
}

static void fill_slice(const csr *a, const uint32_t *rows, size_t count, sliced_rows *s, slice *to) {
    for (size_t lane = 0; lane < SLICE_ROWS; lane++) {
        const uint32_t i = rows[lane < count ? lane : count - 1];
        to->row[lane] = i;
        for (size_t k = 0; k < to->length; k++) put(s, to->begin + k * SLICE_ROWS + lane, a->indptr[i] + k);
    }
}

/* Allocates the entries of slices and, for 16 bits, those of long rows behind them. */
static lam_status reserve(sliced_rows *s, size_t entries, size_t long_entries, bool halves,
                          lam_error *error) {
    if (halves) {
        s->half_indices = memory_allocate(entries + long_entries, sizeof *s->half_indices, "operator", error);
        s->halves = memory_allocate(entries + long_entries, sizeof *s->halves, "operator", error);
        return s->half_indices != NULL && s->halves != NULL ? LAM_OK : LAM_ERR_MEMORY;
    }
    s->indices = memory_allocate(entries, sizeof *s->indices, "operator", error);
    s->data = memory_allocate(entries, sizeof *s->data, "operator", error);
    return s->indices != NULL && s->data != NULL ? LAM_OK : LAM_ERR_MEMORY;
}

/* Places the long rows; `entries` is the number of entries in slices. */
static void place_long(sliced_rows *s, uint64_t entries) {
    const csr *a = s->all;
    for (size_t i = 0; i < a->n; i++) {
        if (length_of(a, i) <= SHORT) continue;
        const size_t k = s->n_long++;
        s->slice_of[i] = SLICE_LONG | (uint32_t)k;
        s->long_rows[k] = (uint32_t)i;
        s->long_begin[k] = s->halves != NULL ? entries : a->indptr[i];
        if (s->halves == NULL) continue;
        for (size_t e = 0; e < length_of(a, i); e++) put(s, entries++, a->indptr[i] + e);
    }
}

lam_status sliced_create(const csr *a, float scale, sliced_rows *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = a->n;
    const bool halves = fits_halves(a, scale);
    size_t begin[SHORT + 2], entries = 0, in_short = 0, n_slices = 0;
    sliced_rows made = {.all = a, .scale = halves ? scale : 1};
    uint32_t *sorted = memory_allocate(n, sizeof *sorted, "operator", error);
    if (sorted == NULL) TRY(LAM_ERR_MEMORY);
    sort_rows(a, sorted, begin);
    for (size_t l = 1; l <= SHORT; l++) {
        const size_t slices = (begin[l + 1] - begin[l] + SLICE_ROWS - 1) / SLICE_ROWS;
        n_slices += slices;
        entries += slices * l * SLICE_ROWS;
        in_short += (begin[l + 1] - begin[l]) * l;
    }
    made.slices = memory_allocate(n_slices, sizeof *made.slices, "operator", error);
    made.slice_of = memory_allocate(n, sizeof *made.slice_of, "operator", error);
    made.long_rows = memory_allocate(n - begin[SHORT + 1], sizeof *made.long_rows, "operator", error);
    made.long_begin = memory_allocate(n - begin[SHORT + 1], sizeof *made.long_begin, "operator", error);
    made.empty_rows = memory_allocate(begin[1], sizeof *made.empty_rows, "operator", error);
    if (made.slices == NULL || made.slice_of == NULL || made.long_rows == NULL || made.long_begin == NULL ||
        made.empty_rows == NULL)
        TRY(LAM_ERR_MEMORY);
    TRY(reserve(&made, entries, (size_t)a->indptr[n] - in_short, halves, error));
    for (size_t i = 0; i < n; i++) made.slice_of[i] = SLICE_NONE;
    place_long(&made, entries);
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

/* Adds the partial sums in a fixed order of pairs, so that all kernels give the same bits. */
static float sum_of_turns(float turns[SLICE_ROWS]) {
    for (size_t half = SLICE_ROWS / 2; half > 0; half /= 2)
        for (size_t l = 0; l < half; l++) turns[l] += turns[l + half];
    return turns[0];
}

enum { WIDTH = 16 };

/* one, one_long: a range of slices and a long row for one vector; wide, wide_long: for WIDTH, side is
 * [n][WIDTH]. */
typedef struct kernels {
    void (*one)(const sliced_rows *s, size_t first, size_t last, const float *x, float *y);
    float (*one_long)(const sliced_rows *s, size_t k, const float *x);
    void (*wide)(const sliced_rows *s, size_t first, size_t last, size_t m, const float *side, float *Y);
    void (*wide_long)(const sliced_rows *s, size_t k, const float *side, float *sums);
} kernels;

#define FORM(name) name##_floats
#define INDEX uint32_t
#define VALUE float
#define VALUE_OF(v) (v)
#define INDICES(s) ((s)->indices)
#define VALUES(s) ((s)->data)
#define LONG_INDICES(s) ((s)->all->indices)
#define LONG_VALUES(s) ((s)->all->data)
#define INDEX_8(p) _mm256_loadu_si256((const __m256i *)(const void *)(p))
#define VALUE_8(p) _mm256_loadu_ps(p)
#define INDEX_16(p) _mm512_loadu_si512(p)
#define VALUE_16(p) _mm512_loadu_ps(p)
#include "solver/linalg/sliced_kernels.inc"

#define FORM(name) name##_halves
#define INDEX uint16_t
#define VALUE uint16_t
#define VALUE_OF(v) float_of_half(v)
#define INDICES(s) ((s)->half_indices)
#define VALUES(s) ((s)->halves)
#define LONG_INDICES(s) ((s)->half_indices)
#define LONG_VALUES(s) ((s)->halves)
#define INDEX_8(p) _mm256_cvtepu16_epi32(_mm_loadu_si128((const __m128i *)(const void *)(p)))
#define VALUE_8(p) _mm256_cvtph_ps(_mm_loadu_si128((const __m128i *)(const void *)(p)))
#define INDEX_16(p) _mm512_cvtepu16_epi32(_mm256_loadu_si256((const __m256i *)(const void *)(p)))
#define VALUE_16(p) _mm512_cvtph_ps(_mm256_loadu_si256((const __m256i *)(const void *)(p)))
#include "solver/linalg/sliced_kernels.inc"

/* The kernels for this CPU and the form of the values. */
static kernels kernels_for(const sliced_rows *s) {
    return s->halves != NULL ? kernels_halves[cpu_best()] : kernels_floats[cpu_best()];
}

size_t sliced_work(size_t n, size_t m) {
    return m > 1 ? n * WIDTH : 0;
}

void sliced_multiply(const sliced_rows *s, size_t m, const float *X, float *Y, float *work,
                     size_t n_threads) {
    const kernels run = kernels_for(s);
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
            float sums[WIDTH];
            if (m > 1)
                run.wide_long(s, k, x, sums);
            else
                sums[0] = run.one_long(s, k, x);
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
    const kernels run = kernels_for(s);
    for (size_t k = 0; k < count; k++) {
        const uint32_t i = rows[k], at = s->slice_of[i];
        if (at == SLICE_NONE)
            y[i] = 0;
        else if ((at & SLICE_LONG) != 0)
            y[i] = run.one_long(s, at & ~SLICE_LONG, x);
        else
            run.one(s, at, at + 1, x, y);
    }
}

size_t sliced_bytes(const sliced_rows *s) {
    const size_t entry = s->halves != NULL ? 2 * sizeof(uint16_t) : sizeof(uint32_t) + sizeof(float);
    return (size_t)s->all->indptr[s->all->n] * entry + s->n_slices * sizeof *s->slices;
}
