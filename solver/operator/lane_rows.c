#include "solver/operator/lane_rows.h"

#include <string.h>

#ifdef CPU_AVX2_TARGET
#include <immintrin.h>
#endif

/* The sums of mean_correction_sum. */
enum { PARTS = 8 };

/* to [count] = from, by parts of which each is a move, as a call takes longer. */
static inline void copy_block(float *to, const float *from, size_t count) {
    if (count == LANES) {
        memcpy(to, from, LANES * sizeof *to);
        return;
    }
    if (count & 8) memcpy(to, from, 8 * sizeof *to);
    to += count & 8;
    from += count & 8;
    if (count & 4) memcpy(to, from, 4 * sizeof *to);
    to += count & 4;
    from += count & 4;
    if (count & 2) memcpy(to, from, 2 * sizeof *to);
    to += count & 2;
    from += count & 2;
    if (count & 1) *to = *from;
}

#define KERNEL(name) name##_portable
#define TARGET
#define LANE_FLOATS 4
#define LOW_ONES(a, b) __builtin_shufflevector(a, b, 0, 4, 1, 5)
#define HIGH_ONES(a, b) __builtin_shufflevector(a, b, 2, 6, 3, 7)
#define LOW_PAIRS(a, b) __builtin_shufflevector(a, b, 0, 1, 4, 5)
#define HIGH_PAIRS(a, b) __builtin_shufflevector(a, b, 2, 3, 6, 7)
#include "solver/operator/lane_rows_kernels.inc"

#ifdef CPU_AVX2_TARGET
#define KERNEL(name) name##_avx2
#define TARGET CPU_AVX2_TARGET
#define LANE_FLOATS 8
#define LOW_ONES(a, b) (lanes) _mm256_unpacklo_ps((__m256)(a), (__m256)(b))
#define HIGH_ONES(a, b) (lanes) _mm256_unpackhi_ps((__m256)(a), (__m256)(b))
#define LOW_PAIRS(a, b) (lanes) _mm256_shuffle_ps((__m256)(a), (__m256)(b), 0x44)
#define HIGH_PAIRS(a, b) (lanes) _mm256_shuffle_ps((__m256)(a), (__m256)(b), 0xEE)
#define EVEN_QUARTERS(a, b) (lanes) _mm256_permute2f128_ps((__m256)(a), (__m256)(b), 0x20)
#define ODD_QUARTERS(a, b) (lanes) _mm256_permute2f128_ps((__m256)(a), (__m256)(b), 0x31)
#include "solver/operator/lane_rows_kernels.inc"

#define KERNEL(name) name##_avx512
#define TARGET CPU_AVX512_TARGET
#define LANE_FLOATS 16
#define LOW_ONES(a, b) (lanes) _mm512_unpacklo_ps((__m512)(a), (__m512)(b))
#define HIGH_ONES(a, b) (lanes) _mm512_unpackhi_ps((__m512)(a), (__m512)(b))
#define LOW_PAIRS(a, b) (lanes) _mm512_shuffle_ps((__m512)(a), (__m512)(b), 0x44)
#define HIGH_PAIRS(a, b) (lanes) _mm512_shuffle_ps((__m512)(a), (__m512)(b), 0xEE)
#define EVEN_QUARTERS(a, b) (lanes) _mm512_shuffle_f32x4((__m512)(a), (__m512)(b), 0x88)
#define ODD_QUARTERS(a, b) (lanes) _mm512_shuffle_f32x4((__m512)(a), (__m512)(b), 0xDD)
#include "solver/operator/lane_rows_kernels.inc"
#endif

#define KERNELS(name) {put_##name, sum_##name, take_##name, radiosity_##name}
static const lane_kernels kernels_of[] = CPU_TABLE(KERNELS(portable), KERNELS(avx2), KERNELS(avx512));
#undef KERNELS

const lane_kernels *lane_kernels_of(cpu_level level) {
    return &kernels_of[level];
}
