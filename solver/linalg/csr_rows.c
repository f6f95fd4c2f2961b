#include "solver/linalg/csr_rows.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

/* Sums that take turns, because an addition waits for the one before it; and the number of widths. */
enum { TURNS = 4, WIDTHS = 4 };

typedef float portable_floats __attribute__((vector_size(16), may_alias));
typedef double portable_doubles __attribute__((vector_size(16), may_alias));

#define NUMBER float
#define ROW_FUNCTION csr_float_row
#define OF(name) csr_floats_##name
#define WIDE CSR_FLOATS_WIDTH
#define PORTABLE portable_floats
#define PORTABLE_SET(x) ((portable_floats){(x), (x), (x), (x)})
#define REGISTER_256 __m256
#define REGISTER_512 __m512
#define PACKED(operation) operation##_ps
#define FMA(a, b, c) __builtin_fmaf(a, b, c)
#include "solver/linalg/csr_rows_of_type.inc"

#define NUMBER double
#define ROW_FUNCTION csr_double_row
#define OF(name) csr_doubles_##name
#define WIDE CSR_DOUBLES_WIDTH
#define PORTABLE portable_doubles
#define PORTABLE_SET(x) ((portable_doubles){(x), (x)})
#define REGISTER_256 __m256d
#define REGISTER_512 __m512d
#define PACKED(operation) operation##_pd
#define FMA(a, b, c) __builtin_fma(a, b, c)
#include "solver/linalg/csr_rows_of_type.inc"
