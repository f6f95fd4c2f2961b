/* Products of slices, compiled for numbers of 32 and of 16 bits. FORM(name); INDEX, VALUE: of an entry;
 * VALUE_OF(v) as a float; INDICES(s), VALUES(s): those of slices; LONG_INDICES(s), LONG_VALUES(s): those of
 * long rows; INDEX_8, VALUE_8, INDEX_16, VALUE_16(p): eight and sixteen in a register. No include guard:
 * sliced.c includes it for each. */

/* --- one vector: a lane for each row -------------------------------------------------------------------- */

static void FORM(slices_portable)(const sliced_rows *s, size_t first, size_t last, const float *x, float *y) {
    for (size_t k = first; k < last; k++) {
        const slice *t = &s->slices[k];
        float sums[SLICE_ROWS] = {0};
        for (size_t e = 0; e < t->length; e++)
            for (size_t lane = 0; lane < SLICE_ROWS; lane++) {
                const uint64_t at = t->begin + e * SLICE_ROWS + lane;
                sums[lane] += VALUE_OF(VALUES(s)[at]) * x[INDICES(s)[at]];
            }
        for (size_t lane = 0; lane < SLICE_ROWS; lane++) y[t->row[lane]] = s->scale * sums[lane];
    }
}

/* A long row: sixteen sums take turns. */
static float FORM(long_portable)(const sliced_rows *s, size_t k, const float *x) {
    const uint64_t begin = s->long_begin[k];
    const size_t count = length_of(s->all, s->long_rows[k]);
    const INDEX *indices = LONG_INDICES(s) + begin;
    const VALUE *values = LONG_VALUES(s) + begin;
    float turns[SLICE_ROWS] = {0};
    for (size_t e = 0; e < count; e++) turns[e % SLICE_ROWS] += VALUE_OF(values[e]) * x[indices[e]];
    return s->scale * sum_of_turns(turns);
}

#if defined(__x86_64__)
TARGET_AVX2 static void FORM(slices_avx2)(const sliced_rows *s, size_t first, size_t last, const float *x,
                                          float *y) {
    for (size_t k = first; k < last; k++) {
        const slice *t = &s->slices[k];
        __m256 low = _mm256_setzero_ps(), high = low;
        float sums[SLICE_ROWS];
        for (size_t e = 0; e < t->length; e++) {
            const INDEX *j = INDICES(s) + t->begin + e * SLICE_ROWS;
            const VALUE *v = VALUES(s) + t->begin + e * SLICE_ROWS;
            low = _mm256_fmadd_ps(VALUE_8(v), _mm256_i32gather_ps(x, INDEX_8(j), 4), low);
            high = _mm256_fmadd_ps(VALUE_8(v + 8), _mm256_i32gather_ps(x, INDEX_8(j + 8), 4), high);
        }
        _mm256_storeu_ps(sums, low);
        _mm256_storeu_ps(sums + 8, high);
        for (size_t lane = 0; lane < SLICE_ROWS; lane++) y[t->row[lane]] = s->scale * sums[lane];
    }
}

TARGET_AVX2 static float FORM(long_avx2)(const sliced_rows *s, size_t k, const float *x) {
    const uint64_t begin = s->long_begin[k];
    const size_t count = length_of(s->all, s->long_rows[k]);
    const INDEX *j = LONG_INDICES(s) + begin;
    const VALUE *v = LONG_VALUES(s) + begin;
    __m256 low = _mm256_setzero_ps(), high = low;
    float turns[SLICE_ROWS];
    size_t e = 0;
    for (; e + SLICE_ROWS <= count; e += SLICE_ROWS) {
        low = _mm256_fmadd_ps(VALUE_8(v + e), _mm256_i32gather_ps(x, INDEX_8(j + e), 4), low);
        high = _mm256_fmadd_ps(VALUE_8(v + e + 8), _mm256_i32gather_ps(x, INDEX_8(j + e + 8), 4), high);
    }
    _mm256_storeu_ps(turns, low);
    _mm256_storeu_ps(turns + 8, high);
    for (size_t l = 0; e < count; e++, l++) turns[l] = __builtin_fmaf(VALUE_OF(v[e]), x[j[e]], turns[l]);
    return s->scale * sum_of_turns(turns);
}

TARGET_AVX512 static float FORM(long_avx512)(const sliced_rows *s, size_t k, const float *x) {
    const uint64_t begin = s->long_begin[k];
    const size_t count = length_of(s->all, s->long_rows[k]);
    const INDEX *j = LONG_INDICES(s) + begin;
    const VALUE *v = LONG_VALUES(s) + begin;
    __m512 sum = _mm512_setzero_ps();
    float turns[SLICE_ROWS];
    size_t e = 0;
    for (; e + SLICE_ROWS <= count; e += SLICE_ROWS)
        sum = _mm512_fmadd_ps(VALUE_16(v + e), _mm512_i32gather_ps(INDEX_16(j + e), x, 4), sum);
    _mm512_storeu_ps(turns, sum);
    for (size_t l = 0; e < count; e++, l++) turns[l] = __builtin_fmaf(VALUE_OF(v[e]), x[j[e]], turns[l]);
    return s->scale * sum_of_turns(turns);
}

TARGET_AVX512 static void FORM(slices_avx512)(const sliced_rows *s, size_t first, size_t last, const float *x,
                                              float *y) {
    const __m512 scale = _mm512_set1_ps(s->scale);
    for (size_t k = first; k < last; k++) {
        const slice *t = &s->slices[k];
        __m512 sum = _mm512_setzero_ps();
        for (size_t e = 0; e < t->length; e++) {
            const INDEX *j = INDICES(s) + t->begin + e * SLICE_ROWS;
            const VALUE *v = VALUES(s) + t->begin + e * SLICE_ROWS;
            sum = _mm512_fmadd_ps(VALUE_16(v), _mm512_i32gather_ps(INDEX_16(j), x, 4), sum);
        }
        _mm512_i32scatter_ps(y, _mm512_loadu_si512(t->row), _mm512_mul_ps(scale, sum), 4);
    }
}
#endif

/* --- several: a lane for each vector ---------------------------------------------------------------------
 */

#define KERNEL(name) FORM(name##_portable)
#define TARGET
#define SCALAR_FMA(a, b, c) ((c) + (a) * (b))
#include "solver/operator/sliced_wide.h"

#if defined(__x86_64__)
#define KERNEL(name) FORM(name##_avx2)
#define TARGET TARGET_AVX2
#define SCALAR_FMA(a, b, c) __builtin_fmaf(a, b, c)
#include "solver/operator/sliced_wide.h"

#define KERNEL(name) FORM(name##_avx512)
#define TARGET TARGET_AVX512
#define SCALAR_FMA(a, b, c) __builtin_fmaf(a, b, c)
#include "solver/operator/sliced_wide.h"
#endif

static kernels FORM(kernels_of_cpu)(void) {
#if defined(__x86_64__)
    if (cpu_has_avx2_set()) {
        if (__builtin_cpu_supports("avx512f"))
            return (kernels){FORM(slices_avx512), FORM(long_avx512), FORM(wide_avx512),
                             FORM(wide_long_avx512)};
        return (kernels){FORM(slices_avx2), FORM(long_avx2), FORM(wide_avx2), FORM(wide_long_avx2)};
    }
#endif
    return (kernels){FORM(slices_portable), FORM(long_portable), FORM(wide_portable),
                     FORM(wide_long_portable)};
}

#undef FORM
#undef INDEX
#undef VALUE
#undef VALUE_OF
#undef INDICES
#undef VALUES
#undef LONG_INDICES
#undef LONG_VALUES
#undef INDEX_8
#undef VALUE_8
#undef INDEX_16
#undef VALUE_16
