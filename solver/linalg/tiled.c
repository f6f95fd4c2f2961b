#include "solver/linalg/tiled.h"

#include "solver/base/cpu.h"
#include "solver/base/half.h"
#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#ifdef CPU_AVX2_TARGET
#include <immintrin.h>
#endif

/* Groups that a thread takes at a time; multiplications below which one thread works; vectors side by side.
 */
enum { GROUPS_AT_ONCE = 64, THREADS_WORTH = 100000, WIDTH = 16 };

/* Halves behind the last that a register may read. */
enum { VALUES_PAST = 16 - TILE_LANES };

void tiled_free(tiled_rows *t) {
    free(t->first);
    free(t->group_of);
    free(t->begin);
    free(t->columns);
    free(t->values);
    *t = (tiled_rows){.n = 0};
}

static lam_status check(const csr *a, float scale, size_t n_groups, const uint32_t *first, lam_error *error) {
    lam_status status = LAM_OK;
    int exponent;
    if (!(scale > 0) || frexpf(scale, &exponent) != .5f)
        FAIL(error, LAM_ERR_ARGUMENT, "scale = %g, must be a power of two", (double)scale);
    if (first[0] != 0 || first[n_groups] != a->n)
        FAIL(error, LAM_ERR_ARGUMENT, "groups are from %u to %u, must be from 0 to %zu", (unsigned)first[0],
             (unsigned)first[n_groups], a->n);
    for (size_t g = 0; g < n_groups; g++)
        if (first[g + 1] <= first[g] || first[g + 1] - first[g] > TILE)
            FAIL(error, LAM_ERR_ARGUMENT, "group %zu has rows from %u to %u, must have 1 to 3", g,
                 (unsigned)first[g], (unsigned)first[g + 1]);
    for (uint64_t e = 0; e < a->indptr[a->n]; e++)
        if (scale * float_of_half(half_of_float(a->data[e] / scale)) != a->data[e])
            FAIL(error, LAM_ERR_ARGUMENT, "entry %zu = %.9g, must be %g times a number of half precision",
                 (size_t)e, (double)a->data[e], (double)scale);
done:
    return status;
}

/* The entries of a group's rows that no tile has yet. */
typedef struct heads {
    uint64_t at[TILE], end[TILE];
    size_t count; /* rows */
} heads;

static heads heads_of(const csr *a, const tiled_rows *t, size_t g) {
    heads h = {.count = t->first[g + 1] - t->first[g]};
    for (size_t r = 0; r < h.count; r++) {
        h.at[r] = a->indptr[t->first[g] + r];
        h.end[r] = a->indptr[t->first[g] + r + 1];
    }
    return h;
}

/* The next group of columns with an entry; n_groups: there is none. */
static size_t next_group(const csr *a, const tiled_rows *t, const heads *h) {
    size_t next = t->n_groups;
    for (size_t r = 0; r < h->count; r++)
        if (h->at[r] < h->end[r] && t->group_of[a->indices[h->at[r]]] < next)
            next = t->group_of[a->indices[h->at[r]]];
    return next;
}

/* Takes the entries in the columns of a group; to: row r of the tile begins at to + r TILE_LANES, or NULL. */
static void take_tile(const csr *a, const tiled_rows *t, size_t columns, heads *h, uint16_t *to) {
    for (size_t r = 0; r < h->count; r++)
        for (; h->at[r] < h->end[r] && t->group_of[a->indices[h->at[r]]] == columns; h->at[r]++)
            if (to != NULL)
                to[r * TILE_LANES + a->indices[h->at[r]] - t->first[columns]] =
                    half_of_float(a->data[h->at[r]] / t->scale);
}

static void count_fours(const csr *a, tiled_rows *t) {
    for (size_t g = 0; g < t->n_groups; g++) {
        heads h = heads_of(a, t, g);
        size_t tiles = 0, columns;
        for (; (columns = next_group(a, t, &h)) < t->n_groups; tiles++) take_tile(a, t, columns, &h, NULL);
        t->begin[g + 1] = t->begin[g] + (tiles + TILES_AT_ONCE - 1) / TILES_AT_ONCE;
    }
}

static void fill(const csr *a, tiled_rows *t) {
    for (size_t g = 0; g < t->n_groups; g++) {
        heads h = heads_of(a, t, g);
        size_t columns;
        for (size_t tile = t->begin[g] * TILES_AT_ONCE; (columns = next_group(a, t, &h)) < t->n_groups;
             tile++) {
            t->columns[tile] = t->first[columns];
            take_tile(a, t, columns, &h,
                      t->values + tile / TILES_AT_ONCE * TILE * TILE_LANES + tile % TILES_AT_ONCE * TILE);
        }
    }
}

lam_status tiled_create(const csr *a, float scale, size_t n_groups, const uint32_t *first, tiled_rows *out,
                        lam_error *error) {
    lam_status status = LAM_OK;
    tiled_rows made = {.n = a->n, .n_groups = n_groups, .scale = scale};
    TRY(check(a, scale, n_groups, first, error));
    made.first = memory_allocate(n_groups + 1, sizeof *made.first, "operator", error);
    made.group_of = memory_allocate(a->n, sizeof *made.group_of, "operator", error);
    made.begin = memory_allocate(n_groups + 1, sizeof *made.begin, "operator", error);
    if (made.first == NULL || made.group_of == NULL || made.begin == NULL) TRY(LAM_ERR_MEMORY);
    memcpy(made.first, first, (n_groups + 1) * sizeof *first);
    for (size_t g = 0; g < n_groups; g++)
        for (uint32_t i = first[g]; i < first[g + 1]; i++) made.group_of[i] = (uint32_t)g;
    count_fours(a, &made);
    const size_t fours = (size_t)made.begin[n_groups];
    made.columns = memory_allocate(fours, TILES_AT_ONCE * sizeof *made.columns, "operator", error);
    made.values =
        memory_allocate(fours * TILE * TILE_LANES + VALUES_PAST, sizeof *made.values, "operator", error);
    if (made.columns == NULL || made.values == NULL) TRY(LAM_ERR_MEMORY);
    fill(a, &made);
    *out = made;
    made = (tiled_rows){.n = 0};
done:
    tiled_free(&made);
    return status;
}

/* Adds the partial sums in a fixed order of pairs, which is that of all kernels. */
static float sum_of_lanes(const float *lanes) {
    float pairs[TILE_LANES / 2];
    for (size_t l = 0; l < TILE_LANES / 2; l++) pairs[l] = lanes[l] + lanes[l + TILE_LANES / 2];
    return (pairs[0] + pairs[3]) + (pairs[1] + pairs[4]) + (pairs[2] + pairs[5]);
}

#define KERNEL(name) name##_portable
#define TARGET
#define SCALAR_FMA(a, b, c) ((c) + (a) * (b))
#define FLOATS_OF_HALVES(from, to)                                                                           \
    for (size_t l = 0; l < TILE_LANES; l++) (to)[l] = float_of_half((from)[l])
#include "solver/linalg/tiled_wide.inc"

static void group_portable(const tiled_rows *t, size_t g, const float *x, float *y) {
    float sums[TILE][TILE_LANES] = {{0}};
    for (uint64_t k = t->begin[g]; k < t->begin[g + 1]; k++)
        for (size_t r = 0; r < TILE; r++)
            for (size_t l = 0; l < TILE_LANES; l++)
                sums[r][l] += float_of_half(t->values[(k * TILE + r) * TILE_LANES + l]) *
                              x[t->columns[k * TILES_AT_ONCE + l / TILE] + l % TILE];
    for (size_t r = 0; t->first[g] + r < t->first[g + 1]; r++)
        y[t->first[g] + r] = t->scale * sum_of_lanes(sums[r]);
}

#ifdef CPU_AVX2_TARGET
#define KERNEL(name) name##_avx2
#define TARGET CPU_AVX2_TARGET
#define SCALAR_FMA(a, b, c) __builtin_fmaf(a, b, c)
#define FLOATS_OF_HALVES(from, to)                                                                           \
    _mm256_storeu_ps(to, _mm256_cvtph_ps(_mm_loadu_si128((const __m128i *)(const void *)(from))));           \
    _mm_storeu_ps((to) + 8, _mm_cvtph_ps(_mm_loadl_epi64((const __m128i *)(const void *)((from) + 8))))
#include "solver/linalg/tiled_wide.inc"

#define KERNEL(name) name##_avx512
#define TARGET CPU_AVX512_TARGET
#define SCALAR_FMA(a, b, c) __builtin_fmaf(a, b, c)
#define FLOATS_OF_HALVES(from, to)                                                                           \
    _mm256_storeu_ps(to, _mm256_cvtph_ps(_mm_loadu_si128((const __m128i *)(const void *)(from))));           \
    _mm_storeu_ps((to) + 8, _mm_cvtph_ps(_mm_loadl_epi64((const __m128i *)(const void *)((from) + 8))))
#include "solver/linalg/tiled_wide.inc"

/* Lanes 0 to 7 and 8 to 11 of a row of four tiles. */
CPU_AVX2_TARGET static void group_avx2(const tiled_rows *t, size_t g, const float *x, float *y) {
    const __m256i left = _mm256_setr_epi32(0, 1, 2, 4, 5, 6, 0, 0),
                  middle = _mm256_setr_epi32(0, 0, 0, 0, 0, 0, 0, 1),
                  right = _mm256_setr_epi32(2, 4, 5, 6, 0, 0, 0, 0);
    __m256 low[TILE] = {_mm256_setzero_ps(), _mm256_setzero_ps(), _mm256_setzero_ps()};
    __m128 high[TILE] = {_mm_setzero_ps(), _mm_setzero_ps(), _mm_setzero_ps()};
    for (uint64_t k = t->begin[g]; k < t->begin[g + 1]; k++) {
        const uint32_t *c = t->columns + k * TILES_AT_ONCE;
        const uint16_t *v = t->values + k * TILE * TILE_LANES;
        const __m256 a = _mm256_loadu2_m128(x + c[1], x + c[0]), b = _mm256_loadu2_m128(x + c[3], x + c[2]);
        const __m256 X =
            _mm256_blend_ps(_mm256_permutevar8x32_ps(a, left), _mm256_permutevar8x32_ps(b, middle), 0xC0);
        const __m128 Z = _mm256_castps256_ps128(_mm256_permutevar8x32_ps(b, right));
        for (size_t r = 0; r < TILE; r++) {
            const uint16_t *h = v + r * TILE_LANES;
            low[r] = _mm256_fmadd_ps(_mm256_cvtph_ps(_mm_loadu_si128((const __m128i *)(const void *)h)), X,
                                     low[r]);
            high[r] = _mm_fmadd_ps(_mm_cvtph_ps(_mm_loadl_epi64((const __m128i *)(const void *)(h + 8))), Z,
                                   high[r]);
        }
    }
    for (size_t r = 0; t->first[g] + r < t->first[g + 1]; r++) {
        float lanes[TILE_LANES];
        _mm256_storeu_ps(lanes, low[r]);
        _mm_storeu_ps(lanes + 8, high[r]);
        y[t->first[g] + r] = t->scale * sum_of_lanes(lanes);
    }
}

CPU_AVX512_TARGET static void group_avx512(const tiled_rows *t, size_t g, const float *x, float *y) {
    const __m512i packed = _mm512_setr_epi32(0, 1, 2, 4, 5, 6, 8, 9, 10, 12, 13, 14, 0, 0, 0, 0);
    __m512 sums[TILE] = {_mm512_setzero_ps(), _mm512_setzero_ps(), _mm512_setzero_ps()};
    for (uint64_t k = t->begin[g]; k < t->begin[g + 1]; k++) {
        const uint32_t *c = t->columns + k * TILES_AT_ONCE;
        const uint16_t *v = t->values + k * TILE * TILE_LANES;
        const __m256 a = _mm256_loadu2_m128(x + c[1], x + c[0]), b = _mm256_loadu2_m128(x + c[3], x + c[2]);
        const __m512 X =
            _mm512_maskz_permutexvar_ps(0xFFF, packed, _mm512_insertf32x8(_mm512_castps256_ps512(a), b, 1));
        for (size_t r = 0; r < TILE; r++) {
            const __m256i h = _mm256_loadu_si256((const __m256i *)(const void *)(v + r * TILE_LANES));
            sums[r] = _mm512_fmadd_ps(_mm512_cvtph_ps(h), X, sums[r]);
        }
    }
    for (size_t r = 0; t->first[g] + r < t->first[g + 1]; r++) {
        float lanes[16];
        _mm512_storeu_ps(lanes, sums[r]);
        y[t->first[g] + r] = t->scale * sum_of_lanes(lanes);
    }
}
#endif

/* one: a group of rows times one vector; wide: times WIDTH, side is [n + TILED_PAST][WIDTH], of which m are
 * written to Y. */
typedef struct kernels {
    void (*one)(const tiled_rows *t, size_t g, const float *x, float *y);
    void (*wide)(const tiled_rows *t, size_t g, size_t m, const float *side, float *Y);
} kernels;

#define KERNELS(name)                                                                                        \
    { group_##name, wide_##name }
static const kernels kernels_of[] = CPU_TABLE(KERNELS(portable), KERNELS(avx2), KERNELS(avx512));
#undef KERNELS

size_t tiled_work(size_t n, size_t m) {
    return m > 1 ? (n + TILED_PAST) * WIDTH : 0;
}

void tiled_multiply(const tiled_rows *t, size_t m, const float *X, float *Y, float *work, size_t n_threads) {
    const kernels run = kernels_of[cpu_best()];
    const size_t n = t->n;
    const bool many = n_threads > 1 && t->begin[t->n_groups] * TILE * TILE_LANES * m > THREADS_WORTH;
#pragma omp parallel num_threads((int)n_threads) if (many)
    {
        if (m > 1)
#pragma omp for schedule(static)
            for (size_t p = 0; p < n + TILED_PAST; p++)
                for (size_t v = 0; v < WIDTH; v++) work[p * WIDTH + v] = v < m && p < n ? X[v * n + p] : 0;
#pragma omp for schedule(dynamic, GROUPS_AT_ONCE)
        for (size_t g = 0; g < t->n_groups; g++) {
            if (m > 1)
                run.wide(t, g, m, work, Y);
            else
                run.one(t, g, X, Y);
        }
    }
}

void tiled_multiply_rows(const tiled_rows *t, size_t count, const uint32_t *rows, const float *x, float *y) {
    const kernels run = kernels_of[cpu_best()];
    for (size_t k = 0; k < count; k++)
        if (k == 0 || t->group_of[rows[k]] != t->group_of[rows[k - 1]])
            run.one(t, t->group_of[rows[k]], x, y);
}

size_t tiled_bytes(const tiled_rows *t) {
    return (size_t)t->begin[t->n_groups] *
               (TILES_AT_ONCE * sizeof *t->columns + TILE * TILE_LANES * sizeof *t->values) +
           t->n_groups * (sizeof *t->first + sizeof *t->begin);
}
