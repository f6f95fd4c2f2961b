/* Y = D (sum_d 256^d Q_d) D X, with the steps D and the digits Q_d of tiles.h, is computed on rows of four
 * tiles: X is scaled by D, the planes d follow from the highest by Horner's rule, and the lanes are added in
 * one order (sum_of_lanes). tiled_kernels.inc has the loop for columns, tiled_wide.c products for several
 * vectors. */
#include "solver/linalg/tiled.h"

#include "solver/base/cpu.h"
#include "solver/base/parallel.h"
#include "store/status.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#ifdef CPU_AVX2_TARGET
#include <immintrin.h>
#endif

/* Groups that a thread takes at a time; multiplications below which one thread works. */
enum { GROUPS_AT_ONCE = 64, THREADS_WORTH = 100000 };

/* By columns, products are added in memory, which is slower than in a register: columns are taken when they
 * hold less than 1/COLUMNS_SHARE of all tiles. */
enum { COLUMNS_SHARE = 8 };

/* Fours behind the last that a register may read. */
enum { FOURS_PAST = 1 };

/* Bytes from a four to the one that is asked for ahead, where the fours are more than a cache of a core
 * holds: measured at 22 MB, a fifth less time than without, 1.5 to 6 kB alike; at 4 MB 3 % more. */
enum { AHEAD = 3072, CACHED = 8 << 20 };

static size_t bytes_ahead(const tiled_rows *t) {
    return t->n_fours * sizeof *t->fours > CACHED ? AHEAD : 0;
}

void tiled_rest(tiled_rows *t) {
    free(t->first);
    free(t->step);
    t->first = NULL;
    t->step = NULL;
}

void tiled_free(tiled_rows *t) {
    tiled_rest(t);
    store_view_free(&t->begins);
    store_view_free(&t->values);
    *t = (tiled_rows){.n = 0};
}

/* The tiles of a plane by rows, those of the lower triangle included: of group g at[begin[g]] to
 * at[begin[g + 1] - 1], by ascending column, twice the number of a tile, and one more where it is transposed.
 */
typedef struct plane_rows {
    uint64_t *begin, *at;
} plane_rows;

static lam_status sort_plane(const tile_matrix *m, size_t plane, size_t n_groups, plane_rows *out,
                             lam_error *error) {
    lam_status status = LAM_OK;
    const size_t count = m->count[plane];
    const tile_digits *tiles = m->tiles[plane];
    uint64_t *begin = memory_allocate(n_groups + 2, sizeof *begin, "operator", error), *at = NULL;
    if (begin == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < count; k++) {
        begin[tiles[k].row + 2]++;
        if (tiles[k].column != tiles[k].row) begin[tiles[k].column + 2]++;
    }
    for (size_t g = 0; g < n_groups; g++) begin[g + 2] += begin[g + 1];
    at = memory_allocate((size_t)begin[n_groups + 1], sizeof *at, "operator", error);
    if (at == NULL) TRY(LAM_ERR_MEMORY);
    /* A row gets its tiles of the lower triangle, from rows above it, before its own. */
    for (size_t k = 0; k < count; k++) {
        at[begin[tiles[k].row + 1]++] = 2 * k;
        if (tiles[k].column != tiles[k].row) at[begin[tiles[k].column + 1]++] = 2 * k + 1;
    }
    *out = (plane_rows){begin, at};
    begin = NULL;
    at = NULL;
done:
    free(begin);
    free(at);
    return status;
}

/* Cuts the tiles of a group into fours whose columns are near enough to the first; returns how many, and
 * writes them to `to` unless that is NULL. */
static size_t pack(const tiled_rows *t, const tile_matrix *m, size_t plane, const plane_rows *rows, size_t g,
                   tile_four *to) {
    size_t fours = 0, used = TILES_AT_ONCE;
    uint32_t base = 0;
    for (uint64_t k = rows->begin[g]; k < rows->begin[g + 1]; k++) {
        const tile_digits *from = &m->tiles[plane][rows->at[k] / 2];
        const bool transposed = rows->at[k] % 2 == 1;
        const uint32_t column = t->first[transposed ? from->row : from->column];
        if (used == TILES_AT_ONCE || column - base > UINT16_MAX) {
            base = column;
            used = 0;
            fours++;
        }
        if (to != NULL) {
            tile_four *four = &to[fours - 1];
            four->base = base;
            four->beyond[used] = (uint16_t)(column - base);
            for (size_t r = 0; r < TILE; r++)
                for (size_t c = 0; c < TILE; c++)
                    four->values[r][used * TILE + c] = transposed ? from->values[c][r] : from->values[r][c];
        }
        used++;
    }
    return fours;
}

/* The fours of groups of rows: their numbers where fours is NULL, else themselves. */
typedef struct packing {
    const tiled_rows *t;
    const tile_matrix *m;
    const plane_rows *rows;
    uint64_t *begin; /* [n_groups n_planes + 1] */
    tile_four *fours;
} packing;

static void pack_groups(const void *job, size_t thread, size_t first, size_t last) {
    const packing *p = job;
    const tiled_rows *t = p->t;
    (void)thread;
    for (size_t g = first; g < last; g++)
        for (size_t d = 0; d < t->n_planes; d++) {
            const size_t part = tiled_part(t, g, d);
            if (p->fours != NULL)
                pack(t, p->m, d, &p->rows[d], g, p->fours + p->begin[part]);
            else
                p->begin[part + 1] = pack(t, p->m, d, &p->rows[d], g, NULL);
        }
}

static lam_status make_fours(tiled_rows *t, const tile_matrix *m, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n_parts = t->n_groups * t->n_planes;
    plane_rows rows[TILE_PLANES] = {{NULL, NULL}};
    uint32_t *narrow = NULL;
    packing p = {.t = t, .m = m, .rows = rows};
    for (size_t d = 0; d < t->n_planes; d++) TRY(sort_plane(m, d, t->n_groups, &rows[d], error));
    p.begin = memory_allocate(n_parts + 1, sizeof *p.begin, "operator", error);
    narrow = t->begins.memory = memory_allocate(n_parts + 1, sizeof *narrow, "operator", error);
    if (p.begin == NULL || narrow == NULL) TRY(LAM_ERR_MEMORY);
    parallel_share(parallel_threads(), t->n_groups, GROUPS_AT_ONCE, pack_groups, &p);
    for (size_t k = 0; k < n_parts; k++) p.begin[k + 1] += p.begin[k];
    if (p.begin[n_parts] > UINT32_MAX)
        FAIL(error, LAM_ERR_MEMORY, "operator: %llu fours of tiles, at most %u can be kept",
             (unsigned long long)p.begin[n_parts], (unsigned)UINT32_MAX);
    for (size_t k = 0; k <= n_parts; k++) narrow[k] = (uint32_t)p.begin[k];
    t->n_fours = narrow[n_parts];
    p.fours = t->values.memory = memory_allocate(t->n_fours + FOURS_PAST, sizeof *p.fours, "operator", error);
    if (p.fours == NULL) TRY(LAM_ERR_MEMORY);
    parallel_share(parallel_threads(), t->n_groups, GROUPS_AT_ONCE, pack_groups, &p);
    t->begin = t->begins.data = narrow;
    t->fours = t->values.data = p.fours;
done:
    free(p.begin);
    for (size_t d = 0; d < TILE_PLANES; d++) {
        free(rows[d].begin);
        free(rows[d].at);
    }
    return status;
}

lam_status tiled_set_rows(tiled_rows *t, const tile_group *groups, const float *step, lam_error *error) {
    lam_status status = LAM_OK;
    uint32_t *first = memory_allocate(t->n_groups + 1, sizeof *first, "operator", error);
    float *steps = memory_allocate(t->n + TILED_PAST, sizeof *steps, "operator", error);
    if (first == NULL || steps == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t g = 0; g < t->n_groups; g++) {
        first[g + 1] = first[g] + groups[g].size;
        assert(first[g + 1] <= t->n);
        for (size_t i = first[g]; i < first[g + 1]; i++) steps[i] = step[g];
    }
    tiled_rest(t);
    t->first = first;
    t->step = steps;
    first = NULL;
    steps = NULL;
done:
    free(first);
    free(steps);
    return status;
}

lam_status tiled_create(const tile_matrix *upper, size_t n_groups, const tile_group *groups,
                        const float *step, tiled_rows *out, lam_error *error) {
    lam_status status = LAM_OK;
    tiled_rows made = {.n_groups = n_groups, .n_planes = 1, .n_numbers = tile_matrix_numbers(upper)};
    for (size_t g = 0; g < n_groups; g++) made.n += groups[g].size;
    for (size_t d = 0; d < TILE_PLANES; d++)
        if (upper->count[d] > 0) made.n_planes = d + 1;
    TRY(tiled_set_rows(&made, groups, step, error));
    TRY(make_fours(&made, upper, error));
    *out = made;
    made = (tiled_rows){.n = 0};
done:
    tiled_free(&made);
    return status;
}

/* Adds the partial sums in a fixed order, which is that of all kernels and of a register that is halved. */
static float sum_of_lanes(const float *lanes) {
    float quarter[4];
    for (size_t l = 0; l < 4; l++) quarter[l] = (lanes[l] + lanes[l + 8]) + lanes[l + 4];
    return (quarter[0] + quarter[2]) + (quarter[1] + quarter[3]);
}

/* Lanes of a whole register, of which a row of four tiles has TILE_LANES. */
enum { LANES_ROOM = 16 };

/* sums_l = sum_r values_rl X_r of the columns of a four, each rounded after every operation. */
static inline void sum_columns_portable(const tile_four *four, const float *X, float *sums) {
    for (size_t l = 0; l < TILE_LANES; l++)
        sums[l] = (float)four->values[0][l] * X[0] + (float)four->values[1][l] * X[1] +
                  (float)four->values[2][l] * X[2];
}

#define KERNEL(name) name##_portable
#define TARGET
#include "solver/linalg/tiled_kernels.inc"

static void group_portable(const tiled_rows *t, size_t g, const float *x, float *y) {
    float sums[TILE][TILE_LANES] = {{0}};
    for (size_t part = g * t->n_planes; part < (g + 1) * t->n_planes; part++) {
        for (size_t l = 0; l < TILE * TILE_LANES; l++) sums[l / TILE_LANES][l % TILE_LANES] *= TILED_RADIX;
        for (size_t f = tiled_begin(t, part), end = tiled_begin(t, part + 1); f < end; f++)
            for (size_t r = 0; r < TILE; r++)
                for (size_t l = 0; l < TILE_LANES; l++)
                    sums[r][l] += (float)t->fours[f].values[r][l] *
                                  x[tiled_column(t, &t->fours[f], l / TILE) + l % TILE];
    }
    for (size_t r = 0, i = t->first[g]; i < t->first[g + 1]; r++, i++)
        y[i] = t->step[i] * sum_of_lanes(sums[r]);
}

#ifdef CPU_AVX2_TARGET
/* Columns 0 to 7 of a row, and 8 to 11, times x. */
CPU_AVX2_TARGET static inline __m256 low_columns(const int8_t *v, float x) {
    const __m128i bytes = _mm_loadl_epi64((const __m128i *)(const void *)v);
    return _mm256_mul_ps(_mm256_cvtepi32_ps(_mm256_cvtepi8_epi32(bytes)), _mm256_set1_ps(x));
}

CPU_AVX2_TARGET static inline __m128 high_columns(const int8_t *v, float x) {
    int32_t last;
    memcpy(&last, v + 8, sizeof last);
    return _mm_mul_ps(_mm_cvtepi32_ps(_mm_cvtepi8_epi32(_mm_cvtsi32_si128(last))), _mm_set1_ps(x));
}

CPU_AVX2_TARGET static inline void sum_columns_avx2(const tile_four *four, const float *X, float *sums) {
    const int8_t(*v)[TILE_LANES] = four->values;
    _mm256_store_ps(sums, _mm256_add_ps(_mm256_add_ps(low_columns(v[0], X[0]), low_columns(v[1], X[1])),
                                        low_columns(v[2], X[2])));
    _mm_store_ps(sums + 8, _mm_add_ps(_mm_add_ps(high_columns(v[0], X[0]), high_columns(v[1], X[1])),
                                      high_columns(v[2], X[2])));
}

CPU_AVX512_TARGET static inline __m512 all_columns(const int8_t *v, float x) {
    const __m128i bytes = _mm_loadu_si128((const __m128i *)(const void *)v);
    return _mm512_mul_ps(_mm512_cvtepi32_ps(_mm512_cvtepi8_epi32(bytes)), _mm512_set1_ps(x));
}

CPU_AVX512_TARGET static inline void sum_columns_avx512(const tile_four *four, const float *X, float *sums) {
    const int8_t(*v)[TILE_LANES] = four->values;
    _mm512_store_ps(sums, _mm512_add_ps(_mm512_add_ps(all_columns(v[0], X[0]), all_columns(v[1], X[1])),
                                        all_columns(v[2], X[2])));
}

#define KERNEL(name) name##_avx2
#define TARGET CPU_AVX2_TARGET
#include "solver/linalg/tiled_kernels.inc"

#define KERNEL(name) name##_avx512
#define TARGET CPU_AVX512_TARGET
#include "solver/linalg/tiled_kernels.inc"

/* y of a group from a quarter of its lanes, [TILE][4]; the fourth row is for show. */
CPU_AVX2_TARGET static inline void finish_group(const tiled_rows *t, size_t g, __m128 a, __m128 b, __m128 c,
                                                float *y) {
    __m128 d = _mm_setzero_ps();
    const uint32_t first = t->first[g], size = t->first[g + 1] - first;
    _MM_TRANSPOSE4_PS(a, b, c, d);
    const __m128 sums =
        _mm_mul_ps(_mm_loadu_ps(t->step + first), _mm_add_ps(_mm_add_ps(a, c), _mm_add_ps(b, d)));
    if (size == TILE) {
        _mm_storel_pi((__m64 *)(void *)(y + first), sums);
        _mm_store_ss(y + first + 2, _mm_movehl_ps(sums, sums));
    } else {
        float each[4];
        _mm_storeu_ps(each, sums);
        for (uint32_t r = 0; r < size; r++) y[first + r] = each[r];
    }
}

/* Lanes 0 to 7 and 8 to 11 of a row of four tiles. */
CPU_AVX2_TARGET static void group_avx2(const tiled_rows *t, size_t g, const float *x, float *y) {
    const size_t ahead = bytes_ahead(t);
    const __m256i left = _mm256_setr_epi32(0, 1, 2, 4, 5, 6, 0, 0),
                  middle = _mm256_setr_epi32(0, 0, 0, 0, 0, 0, 0, 1),
                  right = _mm256_setr_epi32(2, 4, 5, 6, 0, 0, 0, 0);
    __m256 low[TILE] = {_mm256_setzero_ps(), _mm256_setzero_ps(), _mm256_setzero_ps()};
    __m128 high[TILE] = {_mm_setzero_ps(), _mm_setzero_ps(), _mm_setzero_ps()};
    for (size_t part = g * t->n_planes; part < (g + 1) * t->n_planes; part++) {
        for (size_t r = 0; r < TILE; r++) {
            low[r] = _mm256_mul_ps(low[r], _mm256_set1_ps(TILED_RADIX));
            high[r] = _mm_mul_ps(high[r], _mm_set1_ps(TILED_RADIX));
        }
        for (size_t f = tiled_begin(t, part), end = tiled_begin(t, part + 1); f < end; f++) {
            const tile_four *four = &t->fours[f];
            const float *from = x + tiled_base(t, four);
            _mm_prefetch((const char *)four + ahead, _MM_HINT_T0);
            const __m256 a = _mm256_loadu2_m128(from + four->beyond[1], from + four->beyond[0]);
            const __m256 b = _mm256_loadu2_m128(from + four->beyond[3], from + four->beyond[2]);
            const __m256 X =
                _mm256_blend_ps(_mm256_permutevar8x32_ps(a, left), _mm256_permutevar8x32_ps(b, middle), 0xC0);
            const __m128 Z = _mm256_castps256_ps128(_mm256_permutevar8x32_ps(b, right));
            for (size_t r = 0; r < TILE; r++) {
                const int8_t *v = four->values[r];
                int32_t last;
                memcpy(&last, v + 8, sizeof last);
                low[r] = _mm256_fmadd_ps(_mm256_cvtepi32_ps(_mm256_cvtepi8_epi32(
                                             _mm_loadl_epi64((const __m128i *)(const void *)v))),
                                         X, low[r]);
                high[r] =
                    _mm_fmadd_ps(_mm_cvtepi32_ps(_mm_cvtepi8_epi32(_mm_cvtsi32_si128(last))), Z, high[r]);
            }
        }
    }
    __m128 quarter[TILE];
    for (size_t r = 0; r < TILE; r++)
        quarter[r] =
            _mm_add_ps(_mm_add_ps(_mm256_castps256_ps128(low[r]), high[r]), _mm256_extractf128_ps(low[r], 1));
    finish_group(t, g, quarter[0], quarter[1], quarter[2], y);
}

CPU_AVX512_TARGET static void group_avx512(const tiled_rows *t, size_t g, const float *x, float *y) {
    const size_t ahead = bytes_ahead(t);
    const __m512i packed = _mm512_setr_epi32(0, 1, 2, 4, 5, 6, 8, 9, 10, 12, 13, 14, 0, 0, 0, 0);
    __m512 lanes[TILE] = {_mm512_setzero_ps(), _mm512_setzero_ps(), _mm512_setzero_ps()};
    for (size_t part = g * t->n_planes; part < (g + 1) * t->n_planes; part++) {
        for (size_t r = 0; r < TILE; r++) lanes[r] = _mm512_mul_ps(lanes[r], _mm512_set1_ps(TILED_RADIX));
        for (size_t f = tiled_begin(t, part), end = tiled_begin(t, part + 1); f < end; f++) {
            const tile_four *four = &t->fours[f];
            const float *from = x + tiled_base(t, four);
            _mm_prefetch((const char *)four + ahead, _MM_HINT_T0);
            const __m256 a = _mm256_loadu2_m128(from + four->beyond[1], from + four->beyond[0]);
            const __m256 b = _mm256_loadu2_m128(from + four->beyond[3], from + four->beyond[2]);
            const __m512 X = _mm512_maskz_permutexvar_ps(0xFFF, packed,
                                                         _mm512_insertf32x8(_mm512_castps256_ps512(a), b, 1));
            for (size_t r = 0; r < TILE; r++) {
                const __m128i v = _mm_loadu_si128((const __m128i *)(const void *)four->values[r]);
                lanes[r] = _mm512_fmadd_ps(_mm512_cvtepi32_ps(_mm512_cvtepi8_epi32(v)), X, lanes[r]);
            }
        }
    }
    __m128 quarter[TILE];
    for (size_t r = 0; r < TILE; r++)
        quarter[r] =
            _mm_add_ps(_mm_add_ps(_mm512_castps512_ps128(lanes[r]), _mm512_extractf32x4_ps(lanes[r], 2)),
                       _mm512_extractf32x4_ps(lanes[r], 1));
    finish_group(t, g, quarter[0], quarter[1], quarter[2], y);
}
#endif

/* Each multiplies a group of rows with the scaled columns, or the transposed rows, added to y. */
typedef struct kernels {
    void (*one)(const tiled_rows *t, size_t g, const float *x, float *y);
    void (*columns)(const tiled_rows *t, size_t g, const float *x, const uint8_t *wanted, float *y);
} kernels;

#define KERNELS(name) {group_##name, columns_##name}
static const kernels kernels_of[] = CPU_TABLE(KERNELS(portable), KERNELS(avx2), KERNELS(avx512));
#undef KERNELS

typedef struct product {
    const tiled_rows *t;
    kernels run;
    const float *scaled;
    float *y;
} product;

static void multiply_groups(const void *job, size_t thread, size_t first, size_t last) {
    const product *p = job;
    (void)thread;
    for (size_t g = first; g < last; g++) p->run.one(p->t, g, p->scaled, p->y);
}

void tiled_multiply(const tiled_rows *t, const float *scaled, float *y, size_t n_threads) {
    const product p = {t, kernels_of[cpu_best()], scaled, y};
    const bool many = t->n_fours * TILE * TILE_LANES > THREADS_WORTH;
    parallel_share(many ? n_threads : 1, t->n_groups, GROUPS_AT_ONCE, multiply_groups, &p);
}

void tiled_multiply_rows(const tiled_rows *t, size_t count, const uint32_t *groups, const float *scaled,
                         float *y) {
    const kernels run = kernels_of[cpu_best()];
    for (size_t k = 0; k < count; k++) run.one(t, groups[k], scaled, y);
}

static bool is_dark(const tiled_rows *t, size_t g, const float *scaled) {
    for (size_t i = t->first[g]; i < t->first[g + 1]; i++)
        if (scaled[i] != 0) return false;
    return true;
}

uint64_t tiled_few(const tiled_rows *t) {
    return t->n_fours / COLUMNS_SHARE;
}

/* Adds the fours of the columns of a group to *met, unless X is 0 there. */
static void meet(const tiled_rows *t, size_t g, const float *scaled, uint64_t *met) {
    if (!is_dark(t, g, scaled))
        *met += tiled_begin(t, (g + 1) * t->n_planes) - tiled_begin(t, g * t->n_planes);
}

bool tiled_few_columns(const tiled_rows *t, const float *scaled) {
    const uint64_t most = tiled_few(t);
    uint64_t met = 0;
    for (size_t g = 0; g < t->n_groups && met <= most; g++) meet(t, g, scaled, &met);
    return met <= most;
}

bool tiled_few_columns_of(const tiled_rows *t, size_t count, const uint32_t *groups, const float *scaled) {
    const uint64_t most = tiled_few(t);
    uint64_t met = 0;
    for (size_t k = 0; k < count && met <= most; k++) meet(t, groups[k], scaled, &met);
    return met <= most;
}

void tiled_add_columns(const tiled_rows *t, size_t g, const float *x, float *y) {
    kernels_of[cpu_best()].columns(t, g, x, NULL, y);
}

/* y += the columns of group g, but for the step of a row, as long as a row of wanted is met. */
static void add_group(const tiled_rows *t, size_t g, const uint8_t *wanted, const float *scaled, float *y) {
    float x[TILE] = {0};
    if (is_dark(t, g, scaled)) return;
    for (size_t r = 0, i = t->first[g]; i < t->first[g + 1]; r++, i++) x[r] = scaled[i];
    kernels_of[cpu_best()].columns(t, g, x, wanted, y);
}

void tiled_multiply_columns(const tiled_rows *t, const float *scaled, float *y) {
    memset(y, 0, (t->n + TILED_PAST) * sizeof *y);
    for (size_t g = 0; g < t->n_groups; g++) add_group(t, g, NULL, scaled, y);
    for (size_t i = 0; i < t->n; i++) y[i] *= t->step[i];
}

void tiled_multiply_columns_of(const tiled_rows *t, size_t n_lit, const uint32_t *lit, size_t n_asked,
                               const uint32_t *asked, const uint8_t *wanted, const float *scaled, float *y) {
    memset(y, 0, (t->n + TILED_PAST) * sizeof *y);
    for (size_t k = 0; k < n_lit; k++) add_group(t, lit[k], wanted, scaled, y);
    for (size_t k = 0; k < n_asked; k++)
        for (size_t i = t->first[asked[k]]; i < t->first[asked[k] + 1]; i++) y[i] *= t->step[i];
}

size_t tiled_bytes(const tiled_rows *t) {
    const size_t parts = t->n_groups * t->n_planes;
    return t->n_fours * sizeof *t->fours + parts * sizeof *t->begin + t->n * sizeof *t->step +
           t->n_groups * sizeof *t->first;
}
