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
#include "solver/linalg/tiled_wide_kernels.inc"

#define KERNEL(name) name##_avx512
#define TARGET CPU_AVX512_TARGET
#define LANE_FLOATS 16
#define LANES_OF(a) (lanes) _mm512_set1_ps(a)
#define LANES_FMA(a, b, c) (lanes) _mm512_fmadd_ps((__m512)(a), (__m512)(b), (__m512)(c))
#define READ_DIGITS(to, from)                                                                                \
    _mm512_store_ps(to, _mm512_cvtepi32_ps(                                                                  \
                            _mm512_cvtepi8_epi32(_mm_loadu_si128((const __m128i *)(const void *)(from)))))
#include "solver/linalg/tiled_wide_kernels.inc"
#endif

typedef void multiply_group(const tiled_rows *t, size_t g, const float *scaled, float *Y);
static multiply_group *const wide[] = CPU_TABLE(wide_portable, wide_avx2, wide_avx512);

typedef struct product {
    const tiled_rows *t;
    multiply_group *run;
    const float *scaled;
    float *Y;
} product;

static void multiply_groups(const void *job, size_t thread, size_t first, size_t last) {
    const product *p = job;
    (void)thread;
    for (size_t g = first; g < last; g++) p->run(p->t, g, p->scaled, p->Y);
}

static void multiply_wide(const tiled_rows *t, const float *scaled, float *Y, size_t n_threads) {
    const product p = {t, wide[cpu_best()], scaled, Y};
    const bool many = t->n_fours > THREADS_WORTH;
    parallel_share(many ? n_threads : 1, t->n_groups, GROUPS_AT_ONCE, multiply_groups, &p);
}

/* A bit for each lane in which a group is not 0. */
static uint32_t lit_lanes(const tiled_rows *t, size_t g, const float *scaled) {
    uint32_t lit = 0;
    for (size_t v = 0; v < TILED_WIDE; v++) {
        int any = 0;
        for (size_t i = t->first[g]; i < t->first[g + 1]; i++) any |= scaled[i * TILED_WIDE + v] != 0;
        lit |= (uint32_t)any << v;
    }
    return lit;
}

/* The lanes below `count` that have few columns. */
static uint32_t find_few(const tiled_rows *t, size_t count, const float *scaled) {
    const uint64_t most = tiled_few(t);
    uint64_t met[TILED_WIDE] = {0};
    uint32_t few = ((uint32_t)1 << count) - 1;
    for (size_t g = 0; g < t->n_groups && few != 0; g++) {
        const uint64_t own = tiled_begin(t, (g + 1) * t->n_planes) - tiled_begin(t, g * t->n_planes);
        for (uint32_t lit = lit_lanes(t, g, scaled) & few; lit != 0; lit &= lit - 1) {
            const int v = __builtin_ctz(lit);
            met[v] += own;
            if (met[v] > most) few &= ~((uint32_t)1 << v);
        }
    }
    return few;
}

/* The lanes of few columns, whose sums are in work, [lane][n + TILED_PAST], until all are there. */
static void multiply_few(const tiled_rows *t, uint32_t few, const float *scaled, float *Y, float *work) {
    const size_t room = t->n + TILED_PAST;
    for (uint32_t left = few; left != 0; left &= left - 1)
        memset(work + (size_t)__builtin_ctz(left) * room, 0, room * sizeof *work);
    for (size_t g = 0; g < t->n_groups; g++)
        for (uint32_t lit = lit_lanes(t, g, scaled) & few; lit != 0; lit &= lit - 1) {
            const size_t v = (size_t)__builtin_ctz(lit);
            float x[TILE] = {0};
            for (size_t r = 0, i = t->first[g]; i < t->first[g + 1]; r++, i++)
                x[r] = scaled[i * TILED_WIDE + v];
            tiled_add_columns(t, g, x, work + v * room);
        }
    for (size_t i = 0; i < t->n; i++)
        for (uint32_t left = few; left != 0; left &= left - 1) {
            const size_t v = (size_t)__builtin_ctz(left);
            Y[i * TILED_WIDE + v] = t->step[i] * work[v * room + i];
        }
}

void tiled_multiply_lanes(const tiled_rows *t, size_t count, const float *scaled, float *Y, float *work,
                          size_t n_threads) {
    const uint32_t few = find_few(t, count, scaled);
    if (few != ((uint32_t)1 << count) - 1) multiply_wide(t, scaled, Y, n_threads);
    if (few != 0) multiply_few(t, few, scaled, Y, work);
}
