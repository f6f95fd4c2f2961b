/* Products of a sparse row with vectors side by side, in single precision and in double. Every sum is made of
 * four that take turns, whatever the width is, so that the bits of a vector do not depend on how many are
 * beside it. */
#ifndef LAMBERT_LINALG_CSR_ROWS_H
#define LAMBERT_LINALG_CSR_ROWS_H

#include "solver/base/cpu.h"

#include <stddef.h>
#include <stdint.h>

/* Most vectors side by side. */
enum { CSR_FLOATS_WIDTH = 32, CSR_DOUBLES_WIDTH = 16 };

/* sums_v = sum_e data_e X_v(indices_e): X is [n][width], best aligned to a cache line. */
typedef void csr_float_row(const uint32_t *indices, const float *data, uint64_t n_entries, const float *X,
                           float *sums);
typedef void csr_double_row(const uint32_t *indices, const float *data, uint64_t n_entries, const double *X,
                            double *sums);

/* A bound on the roundings of one term of a sum: the product (without FMA), each addition of its quarter, and
 * two more. */
static inline double csr_doubles_roundings(uint64_t n_entries) {
    return (double)(n_entries / 4 + 4);
}

/* The smallest width that has kernels and holds n_vectors, at most CSR_FLOATS_WIDTH or CSR_DOUBLES_WIDTH. */
size_t csr_floats_width(size_t n_vectors);
size_t csr_doubles_width(size_t n_vectors);

/* The fastest product for this CPU and one of these widths. */
csr_float_row *csr_floats_row(size_t width);
csr_double_row *csr_doubles_row(size_t width);

/* The products of one level, at most cpu_best(). For tests. */
csr_float_row *csr_floats_row_of(cpu_level level, size_t width);
csr_double_row *csr_doubles_row_of(cpu_level level, size_t width);

#endif
