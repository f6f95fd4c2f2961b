/* Compiles the inner loops of panel products for each instruction set. */
#include "solver/linalg/panel_kernels.h"

#include "solver/base/cpu.h"
#include "solver/base/half.h"

#include <string.h>
#ifdef CPU_AVX2_TARGET
#include <immintrin.h>
#endif

/* Prefetch distance in bytes. It is no multiple of 4096, because then the line prefetched and the line in use
 * would share a set of the nearest cache, which made answers in f32 a third slower (Xeon, 2 cores). */
#define AHEAD_BYTES 3072
/* The distance for PANEL_ROWS, where each row of a tile is a stream of its own and advances at a quarter of
 * the speed. */
#define ROWS_AHEAD_BYTES 512

typedef float lane4 __attribute__((vector_size(16), may_alias));
typedef float lane4_anywhere __attribute__((vector_size(16), may_alias, aligned(4)));

static inline float lane_sum_portable(lane4 x) {
    return (x[0] + x[2]) + (x[1] + x[3]);
}
#define NAME(name) name##_portable
#define TARGET
#define lane lane4
#define LANE_SET(x) ((lane4){(x), (x), (x), (x)})
#define LANE_FMA(a, b, c) ((a) * (b) + (c))
#define LANE_SUM(x) lane_sum_portable(x)
#define EACH_OF_4(f, p) ((lane4){f((p)[0]), f((p)[1]), f((p)[2]), f((p)[3])})
#define LOAD_F32(p) (*(const lane4_anywhere *)(p))
#define LOAD_F16(p) EACH_OF_4(float_of_half, p)
#define LOAD_I8(p) EACH_OF_4((float), p)
#define ROW_TILE 2
#define VECTOR_TILE 1
#define PROJECT_TILE 1
#include "solver/linalg/panel_kernels_each.inc"

#ifdef CPU_AVX2_TARGET
#define LOAD_128(p) _mm_loadu_si128((const __m128i *)(const void *)(p))
#define LOAD_256(p) _mm256_loadu_si256((const __m256i *)(const void *)(p))

CPU_AVX2_TARGET static inline float lane_sum_avx2(__m256 x) {
    __m128 four = _mm256_castps256_ps128(x) + _mm256_extractf128_ps(x, 1);
    __m128 two = four + _mm_movehl_ps(four, four);
    return _mm_cvtss_f32(two + _mm_movehdup_ps(two));
}
#define NAME(name) name##_avx2
#define TARGET CPU_AVX2_TARGET
#define lane __m256
#define LANE_SET(x) _mm256_set1_ps(x)
#define LANE_FMA(a, b, c) _mm256_fmadd_ps(a, b, c)
#define LANE_SUM(x) lane_sum_avx2(x)
#define LOAD_F32(p) _mm256_loadu_ps(p)
#define LOAD_F16(p) _mm256_cvtph_ps(LOAD_128(p))
#define LOAD_I8(p)                                                                                           \
    _mm256_cvtepi32_ps(_mm256_cvtepi8_epi32(_mm_loadl_epi64((const __m128i *)(const void *)(p))))
#define ROW_TILE 4
#define VECTOR_TILE 1
#define PROJECT_TILE 2
#include "solver/linalg/panel_kernels_each.inc"

CPU_AVX512_TARGET static inline float lane_sum_avx512(__m512 x) {
    __m256 eight =
        _mm512_castps512_ps256(x) + _mm256_castpd_ps(_mm512_extractf64x4_pd(_mm512_castps_pd(x), 1));
    __m128 four = _mm256_castps256_ps128(eight) + _mm256_extractf128_ps(eight, 1);
    __m128 two = four + _mm_movehl_ps(four, four);
    return _mm_cvtss_f32(two + _mm_movehdup_ps(two));
}
#define NAME(name) name##_avx512
#define TARGET CPU_AVX512_TARGET
#define lane __m512
#define LANE_SET(x) _mm512_set1_ps(x)
#define LANE_FMA(a, b, c) _mm512_fmadd_ps(a, b, c)
#define LANE_SUM(x) lane_sum_avx512(x)
#define LOAD_F32(p) _mm512_loadu_ps(p)
#define LOAD_F16(p) _mm512_cvtph_ps(LOAD_256(p))
#define LOAD_I8(p) _mm512_cvtepi32_ps(_mm512_cvtepi8_epi32(LOAD_128(p)))
#define ROW_TILE 4
#define VECTOR_TILE 4
#define PROJECT_TILE 4
#include "solver/linalg/panel_kernels_each.inc"
#endif

const panel_kernels *panel_kernels_of(cpu_level level) {
    static const panel_kernels *const table[] = CPU_TABLE(&kernels_portable, &kernels_avx2, &kernels_avx512);
    return table[level];
}
