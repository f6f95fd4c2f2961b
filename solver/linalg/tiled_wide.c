/* Products of a tiled matrix with vectors side by side (tiled.h). Each tile is read once for all of them,
 * and no lane waits for another. tiled_wide_kernels.inc has the loops. */
#include "solver/base/cpu.h"
#include "solver/base/parallel.h"
#include "solver/linalg/tiled.h"

#include <string.h>

#ifdef CPU_AVX2_TARGET
#include <immintrin.h>
#endif

/* Groups that a thread takes at a time; fours below which one thread works; fours whose digits are converted
 * at once; digits of a row of a four, and those behind them that a register has too, in the last row of the
 * four that follows, which is always there. */
enum { GROUPS_AT_ONCE = 64, THREADS_WORTH = 200, CHUNK = 32, DIGITS = 16 };

#define KERNEL(name) name##_portable
#define TARGET
#define LANE_FLOATS 4
#define LANES_OF(a) ((lanes){0} + (a))
#define LANES_FMA(a, b, c) ((c) + (a) * (b))
#define READ_DIGITS(to, from)                                                                                \
    for (size_t l = 0; l < TILE_LANES; l++) (to)[l] = (from)[l]
#define LANES_LIT(x) (((x)[0] != 0) | ((x)[1] != 0) << 1 | ((x)[2] != 0) << 2 | ((x)[3] != 0) << 3)
#include "solver/linalg/tiled_wide_kernels.inc"

#ifdef CPU_AVX2_TARGET
#define KERNEL(name) name##_avx2
#define TARGET CPU_AVX2_TARGET
#define LANE_FLOATS 8
#define LANES_OF(a) (lanes) _mm256_set1_ps(a)
#define LANES_FMA(a, b, c) (lanes) _mm256_fmadd_ps((__m256)(a), (__m256)(b), (__m256)(c))
#define READ_DIGITS(to, from)                                                                                \
    for (size_t l = 0; l < DIGITS; l += 8)                                                                   \
    _mm256_store_ps((to) + l, _mm256_cvtepi32_ps(_mm256_cvtepi8_epi32(                                       \
                                  _mm_loadl_epi64((const __m128i *)(const void *)((from) + l)))))
#define LANES_LIT(x) _mm256_movemask_ps(_mm256_cmp_ps(_mm256_load_ps(x), _mm256_setzero_ps(), _CMP_NEQ_UQ))
#include "solver/linalg/tiled_wide_kernels.inc"

#define KERNEL(name) name##_avx512
#define TARGET CPU_AVX512_TARGET
#define LANE_FLOATS 16
#define LANES_OF(a) (lanes) _mm512_set1_ps(a)
#define LANES_FMA(a, b, c) (lanes) _mm512_fmadd_ps((__m512)(a), (__m512)(b), (__m512)(c))
#define READ_DIGITS(to, from)                                                                                \
    _mm512_store_ps(to, _mm512_cvtepi32_ps(                                                                  \
                            _mm512_cvtepi8_epi32(_mm_loadu_si128((const __m128i *)(const void *)(from)))))
#define LANES_LIT(x) _mm512_cmp_ps_mask(_mm512_load_ps(x), _mm512_setzero_ps(), _CMP_NEQ_UQ)
#include "solver/linalg/tiled_wide_kernels.inc"
#endif

typedef struct kernels {
    void (*rows)(const tiled_rows *t, size_t g, const float *scaled, float *Y);
    void (*columns)(const tiled_rows *t, size_t g, const float (*x)[TILED_WIDE], float *Y);
    void (*lit)(const tiled_rows *t, const float *scaled, uint16_t *lit);
} kernels;

#define KERNELS(name) {wide_##name, wide_columns_##name, find_lit_##name}
static const kernels kernels_of[] = CPU_TABLE(KERNELS(portable), KERNELS(avx2), KERNELS(avx512));
#undef KERNELS

typedef struct product {
    const tiled_rows *t;
    const kernels *run;
    const float *scaled;
    float *Y;
} product;

static void multiply_groups(const void *job, size_t thread, size_t first, size_t last) {
    const product *p = job;
    (void)thread;
    for (size_t g = first; g < last; g++) p->run->rows(p->t, g, p->scaled, p->Y);
}

static void multiply_wide(const tiled_rows *t, const float *scaled, float *Y, size_t n_threads) {
    const product p = {t, &kernels_of[cpu_best()], scaled, Y};
    const bool many = t->n_fours > THREADS_WORTH;
    parallel_share(many ? n_threads : 1, t->n_groups, GROUPS_AT_ONCE, multiply_groups, &p);
}

/* Fours of the columns that lanes need: of each lane by itself, and of any of those that have few. */
typedef struct lit_columns {
    const uint16_t *lit; /* [n_groups], a bit for each lane in which a group is not 0 */
    uint32_t few;        /* lanes, a bit each */
    uint64_t apart, together;
} lit_columns;

static uint64_t fours_of(const tiled_rows *t, size_t g) {
    return tiled_begin(t, (g + 1) * t->n_planes) - tiled_begin(t, g * t->n_planes);
}

/* The lanes below `count` that have few columns. */
static lit_columns find_few(const tiled_rows *t, size_t count, const uint16_t *lit) {
    const uint64_t most = tiled_few(t);
    uint64_t met[TILED_WIDE] = {0};
    lit_columns c = {.lit = lit, .few = ((uint32_t)1 << count) - 1};
    for (size_t g = 0; g < t->n_groups && c.few != 0; g++)
        for (uint32_t left = lit[g] & c.few; left != 0; left &= left - 1) {
            const int v = __builtin_ctz(left);
            met[v] += fours_of(t, g);
            if (met[v] > most) c.few &= ~((uint32_t)1 << v);
        }
    for (uint32_t left = c.few; left != 0; left &= left - 1) c.apart += met[__builtin_ctz(left)];
    for (size_t g = 0; g < t->n_groups && c.few != 0; g++)
        if (lit[g] & c.few) c.together += fours_of(t, g);
    return c;
}

/* The lanes of few columns, whose sums are in work, [lane][n + TILED_PAST], until all are there. */
static void multiply_apart(const tiled_rows *t, const lit_columns *c, const float *scaled, float *Y,
                           float *work) {
    const size_t room = t->n + TILED_PAST;
    for (uint32_t left = c->few; left != 0; left &= left - 1)
        memset(work + (size_t)__builtin_ctz(left) * room, 0, room * sizeof *work);
    for (size_t g = 0; g < t->n_groups; g++)
        for (uint32_t left = c->lit[g] & c->few; left != 0; left &= left - 1) {
            const size_t v = (size_t)__builtin_ctz(left);
            float x[TILE] = {0};
            for (size_t r = 0, i = t->first[g]; i < t->first[g + 1]; r++, i++)
                x[r] = scaled[i * TILED_WIDE + v];
            tiled_add_columns(t, g, x, work + v * room);
        }
    for (size_t i = 0; i < t->n; i++)
        for (uint32_t left = c->few; left != 0; left &= left - 1) {
            const size_t v = (size_t)__builtin_ctz(left);
            Y[i * TILED_WIDE + v] = t->step[i] * work[v * room + i];
        }
}

/* The same side by side, the sums in work, [n + TILED_PAST][lane]. */
static void multiply_together(const tiled_rows *t, const lit_columns *c, const float *scaled, float *Y,
                              float *work) {
    const kernels *run = &kernels_of[cpu_best()];
    memset(work, 0, (t->n + TILED_PAST) * TILED_WIDE * sizeof *work);
    for (size_t g = 0; g < t->n_groups; g++) {
        _Alignas(64) float x[TILE][TILED_WIDE] = {{0}};
        const uint32_t lit = c->lit[g] & c->few;
        if (lit == 0) continue;
        for (size_t r = 0, i = t->first[g]; i < t->first[g + 1]; r++, i++)
            for (size_t v = 0; v < TILED_WIDE; v++)
                x[r][v] = lit >> v & 1 ? scaled[i * TILED_WIDE + v] : 0.0f;
        run->columns(t, g, (const float(*)[TILED_WIDE])x, work);
    }
    for (size_t i = 0; i < t->n; i++)
        for (size_t v = 0; v < TILED_WIDE; v++)
            if (c->few >> v & 1) Y[i * TILED_WIDE + v] = t->step[i] * work[i * TILED_WIDE + v];
}

/* Sums of columns, and what is lit. */
static size_t sums_of(const tiled_rows *t) {
    return (t->n + TILED_PAST) * TILED_WIDE;
}

size_t tiled_lanes_work(const tiled_rows *t) {
    return sums_of(t) * sizeof(float) + t->n_groups * sizeof(uint16_t);
}

/* Columns of all lanes side by side take as long as of so many lanes one after another. */
enum { TOGETHER_WORTH = 4 };

void tiled_multiply_lanes(const tiled_rows *t, size_t count, const float *scaled, float *Y, float *work,
                          size_t n_threads) {
    uint16_t *lit = (uint16_t *)(void *)(work + sums_of(t));
    kernels_of[cpu_best()].lit(t, scaled, lit);
    const lit_columns c = find_few(t, count, lit);
    if (c.few != ((uint32_t)1 << count) - 1) multiply_wide(t, scaled, Y, n_threads);
    if (c.few == 0) return;
    if (c.together * TOGETHER_WORTH < c.apart)
        multiply_together(t, &c, scaled, Y, work);
    else
        multiply_apart(t, &c, scaled, Y, work);
}
