/* The sums over runs for each instruction set. */
#include "solver/linalg/segments.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#ifdef CPU_AVX2_TARGET
#include <immintrin.h>
#endif

struct segment_kernels {
    void (*sum)(const segments *s, const float *x, float *t);
};

/* Eight and four sums side by side. */
typedef double wide __attribute__((vector_size(64)));
typedef double half __attribute__((vector_size(32)));
typedef float wide_floats __attribute__((vector_size(32), aligned(4), may_alias));

#define WIDE(x) __builtin_convertvector(*(const wide_floats *)(x), wide)

#define KERNEL(name) name##_portable
#define TARGET
static inline void load_eight_portable(const float *x, size_t count, wide *lanes) {
    *lanes = (wide){0};
    for (size_t j = 0; j < count; j++) (*lanes)[j] = (double)x[j];
}
static inline void load_four_portable(const float *x, size_t count, half *lanes) {
    *lanes = (half){0};
    for (size_t j = 0; j < count; j++) (*lanes)[j] = (double)x[j];
}
#include "solver/linalg/segment_kernels.inc"
static const segment_kernels kernels_portable = {sum_portable};

#ifdef CPU_AVX2_TARGET
#define KERNEL(name) name##_avx2
#define TARGET CPU_AVX2_TARGET
TARGET static inline __attribute__((always_inline)) void load_eight_avx2(const float *x, size_t count,
                                                                         wide *lanes) {
    static const int32_t masks[16] = {-1, -1, -1, -1, -1, -1, -1, -1};
    const __m256 first =
        _mm256_maskload_ps(x, _mm256_loadu_si256((const __m256i_u *)(const void *)(masks + 8 - count)));
    const __m256d low = _mm256_cvtps_pd(_mm256_castps256_ps128(first)),
                  high = _mm256_cvtps_pd(_mm256_extractf128_ps(first, 1));
    memcpy(lanes, &low, sizeof low);
    memcpy((char *)lanes + sizeof low, &high, sizeof high);
}
TARGET static inline __attribute__((always_inline)) void load_four_avx2(const float *x, size_t count,
                                                                        half *lanes) {
    static const int32_t masks[8] = {-1, -1, -1, -1};
    *lanes = (half)_mm256_cvtps_pd(
        _mm_maskload_ps(x, _mm_loadu_si128((const __m128i_u *)(const void *)(masks + 4 - count))));
}
#include "solver/linalg/segment_kernels.inc"
static const segment_kernels kernels_avx2 = {sum_avx2};

#define KERNEL(name) name##_avx512
#define TARGET CPU_AVX512_TARGET
TARGET static inline __attribute__((always_inline)) void load_eight_avx512(const float *x, size_t count,
                                                                           wide *lanes) {
    *lanes = (wide)_mm512_cvtps_pd(_mm256_maskz_loadu_ps((__mmask8)((1u << count) - 1), x));
}
TARGET static inline __attribute__((always_inline)) void load_four_avx512(const float *x, size_t count,
                                                                          half *lanes) {
    *lanes = (half)_mm256_cvtps_pd(_mm_maskz_loadu_ps((__mmask8)((1u << count) - 1), x));
}
#include "solver/linalg/segment_kernels.inc"
#include "store/groups.h"
static const segment_kernels kernels_avx512 = {sum_avx512};
#endif

const segment_kernels *segment_kernels_of(cpu_level level) {
    static const segment_kernels *const table[] =
        CPU_TABLE(&kernels_portable, &kernels_avx2, &kernels_avx512);
    return table[level];
}

lam_status segments_create(size_t n, size_t k, uint64_t *begin, float *weight, segments *s,
                           lam_error *error) {
    lam_status status = LAM_OK;
    if (begin[0] != 0)
        FAIL(error, LAM_ERR_NUMERIC, STORE_OPERATOR "/I[0] = %" PRIu64 ", must be 0", begin[0]);
    for (size_t p = 0; p < k; p++)
        if (begin[p + 1] < begin[p] || begin[p + 1] > n)
            FAIL(error, LAM_ERR_NUMERIC,
                 STORE_OPERATOR "/I[%zu] = %" PRIu64 ", must be at least %" PRIu64 " and at most %zu", p + 1,
                 begin[p + 1], begin[p], n);
    if (k > 0 && begin[k] != n)
        FAIL(error, LAM_ERR_NUMERIC, STORE_OPERATOR "/I[%zu] = %" PRIu64 ", must be %zu", k, begin[k], n);
    for (size_t j = 0; weight != NULL && j < n; j++)
        if (!isfinite(weight[j]))
            FAIL(error, LAM_ERR_NUMERIC, STORE_OPERATOR "/weight[%zu] = %g, must be finite", j,
                 (double)weight[j]);
    *s = (segments){
        .n = n, .k = k, .begin = begin, .weight = weight, .kernels = segment_kernels_of(cpu_best())};
done:
    return status;
}

void segments_free(segments *s) {
    free(s->begin);
    free(s->weight);
    *s = (segments){0};
}

size_t segments_bytes(const segments *s) {
    return (s->k + 1) * sizeof *s->begin + (s->weight != NULL ? s->n * sizeof *s->weight : 0);
}

void segments_sum(const segments *s, const float *x, float *t) {
    s->kernels->sum(s, x, t);
}

void segments_spread(const segments *s, const float *t, float *x) {
    for (size_t p = 0; p < s->k; p++)
        for (uint64_t j = s->begin[p]; j < s->begin[p + 1]; j++)
            x[j] = s->weight != NULL ? s->weight[j] * t[p] : t[p];
}
