#include "solver/base/half.h"

#include "solver/base/cpu.h"

#ifdef CPU_AVX2_TARGET
#include <immintrin.h>
#endif

/* A half is written at or before all floats that are read later. */
static void convert_portable(const float *x, size_t count, char *halves) {
    for (size_t i = 0; i < count; i++) {
        const uint16_t half = half_of_float(x[i]);
        memcpy(halves + i * sizeof half, &half, sizeof half);
    }
}

#ifdef CPU_AVX2_TARGET
CPU_AVX2_TARGET static void convert_avx2(const float *x, size_t count, char *halves) {
    size_t i = 0;
    for (; count - i >= 8; i += 8)
        _mm_storeu_si128((__m128i *)(void *)(halves + 2 * i),
                         _mm256_cvtps_ph(_mm256_loadu_ps(x + i), _MM_FROUND_TO_NEAREST_INT));
    convert_portable(x + i, count - i, halves + 2 * i);
}

CPU_AVX512_TARGET static void convert_avx512(const float *x, size_t count, char *halves) {
    size_t i = 0;
    for (; count - i >= 16; i += 16)
        _mm256_storeu_si256((__m256i *)(void *)(halves + 2 * i),
                            _mm512_cvtps_ph(_mm512_loadu_ps(x + i), _MM_FROUND_TO_NEAREST_INT));
    convert_portable(x + i, count - i, halves + 2 * i);
}
#endif

typedef void convert(const float *x, size_t count, char *halves);

void halves_of_floats(const float *x, size_t count, void *halves) {
    static convert *const converts[] = CPU_TABLE(convert_portable, convert_avx2, convert_avx512);
    converts[cpu_best()](x, count, halves);
}
