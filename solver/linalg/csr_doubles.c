/* The instruction sets that products in double with vectors side by side are compiled for. */
#include "solver/linalg/csr_doubles.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

/* Sums that take turns: additions wait for each other less. */
enum { TURNS = 4, WIDTHS = 4, NARROW = 4, MIDDLE = 8, WIDE = CSR_DOUBLES_WIDTH };
static const size_t widths[WIDTHS] = {1, NARROW, MIDDLE, WIDE};

typedef double number;
typedef csr_double_row row_function;

typedef double lane2 __attribute__((vector_size(16), may_alias));

#define KERNEL(name) name##_portable
#define TARGET
#define lane lane2
#define LANE_SET(x) ((lane2){(x), (x)})
#define LANE_FMA(a, b, c) ((a) * (b) + (c))
#define LANE_LOAD(p) (*(const lane2 *)(p))
#define LANE_STORE(p, x) (*(lane2 *)(p) = (x))
#define SCALAR_FMA(a, b, c) ((a) * (b) + (c))
#define AT_ONCE 4
#include "solver/linalg/csr_side_by_side.inc"

#if defined(__x86_64__)
#define KERNEL(name) name##_avx2
#define TARGET __attribute__((target("avx2,fma")))
#define lane __m256d
#define LANE_SET(x) _mm256_set1_pd(x)
#define LANE_FMA(a, b, c) _mm256_fmadd_pd(a, b, c)
#define LANE_LOAD(p) _mm256_loadu_pd(p)
#define LANE_STORE(p, x) _mm256_storeu_pd(p, x)
#define SCALAR_FMA(a, b, c) __builtin_fma(a, b, c)
#define AT_ONCE 8
#include "solver/linalg/csr_side_by_side.inc"

#define KERNEL(name) name##_avx512
#define TARGET __attribute__((target("avx512f,fma")))
#define lane __m512d
#define LANE_SET(x) _mm512_set1_pd(x)
#define LANE_FMA(a, b, c) _mm512_fmadd_pd(a, b, c)
#define LANE_LOAD(p) _mm512_loadu_pd(p)
#define LANE_STORE(p, x) _mm512_storeu_pd(p, x)
#define SCALAR_FMA(a, b, c) __builtin_fma(a, b, c)
#define AT_ONCE 16
#define ROW_NARROW row_narrow_avx2 /* half a register; the bits are the same */
#include "solver/linalg/csr_side_by_side.inc"
#endif

size_t csr_doubles_width(size_t n_vectors) {
    size_t k = 0;
    while (k + 1 < WIDTHS && widths[k] < n_vectors) k++;
    return widths[k];
}

csr_double_row *csr_doubles_row_of(size_t instruction_set, size_t width) {
    csr_double_row *const *available[3];
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

csr_double_row *csr_doubles_row(size_t width) {
    return csr_doubles_row_of(0, width);
}
