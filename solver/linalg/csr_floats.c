/* The instruction sets that products with vectors side by side are compiled for. */
#include "solver/linalg/csr_floats.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

/* Sums that take turns: additions wait for each other less. */
enum { TURNS = 4, WIDTHS = 4, NARROW = 8, MIDDLE = 16, WIDE = 32 };
static const size_t widths[WIDTHS] = {1, NARROW, MIDDLE, WIDE};

typedef float number;
typedef csr_float_row row_function;

typedef float lane4 __attribute__((vector_size(16), may_alias));

#define KERNEL(name) name##_portable
#define TARGET
#define lane lane4
#define LANE_SET(x) ((lane4){(x), (x), (x), (x)})
#define LANE_FMA(a, b, c) ((a) * (b) + (c))
#define LANE_LOAD(p) (*(const lane4 *)(p))
#define LANE_STORE(p, x) (*(lane4 *)(p) = (x))
#define SCALAR_FMA(a, b, c) ((a) * (b) + (c))
#define AT_ONCE 8
#include "solver/linalg/csr_side_by_side.inc"

#if defined(__x86_64__)
#define KERNEL(name) name##_avx2
#define TARGET __attribute__((target("avx2,fma")))
#define lane __m256
#define LANE_SET(x) _mm256_set1_ps(x)
#define LANE_FMA(a, b, c) _mm256_fmadd_ps(a, b, c)
#define LANE_LOAD(p) _mm256_loadu_ps(p)
#define LANE_STORE(p, x) _mm256_storeu_ps(p, x)
#define SCALAR_FMA(a, b, c) __builtin_fmaf(a, b, c)
#define AT_ONCE 16
#include "solver/linalg/csr_side_by_side.inc"

#define KERNEL(name) name##_avx512
#define TARGET __attribute__((target("avx512f,fma")))
#define lane __m512
#define LANE_SET(x) _mm512_set1_ps(x)
#define LANE_FMA(a, b, c) _mm512_fmadd_ps(a, b, c)
#define LANE_LOAD(p) _mm512_loadu_ps(p)
#define LANE_STORE(p, x) _mm512_storeu_ps(p, x)
#define SCALAR_FMA(a, b, c) __builtin_fmaf(a, b, c)
#define AT_ONCE 32
#define ROW_NARROW row_narrow_avx2 /* half a register; the bits are the same */
#include "solver/linalg/csr_side_by_side.inc"
#endif

size_t csr_floats_width(size_t n_vectors) {
    size_t k = 0;
    while (k + 1 < WIDTHS && widths[k] < n_vectors) k++;
    return widths[k];
}

csr_float_row *csr_floats_row_of(size_t instruction_set, size_t width) {
    csr_float_row *const *available[3];
    size_t count = 0, k = 0;
#if defined(__x86_64__)
    const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    if (avx2 && __builtin_cpu_supports("avx512f")) available[count++] = rows_avx512;
    if (avx2) available[count++] = rows_avx2;
#endif
    available[count++] = rows_portable;
    while (k + 1 < WIDTHS && widths[k] != width) k++;
    return instruction_set < count ? available[instruction_set][k] : NULL;
}

csr_float_row *csr_floats_row(size_t width) {
    return csr_floats_row_of(0, width);
}
