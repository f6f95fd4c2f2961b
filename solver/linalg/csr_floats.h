/* Products of sparse rows with vectors in single precision that lie side by side. */
#ifndef LAMBERT_LINALG_CSR_FLOATS_H
#define LAMBERT_LINALG_CSR_FLOATS_H

#include "solver/linalg/csr.h"

/* Vectors side by side at most. */
enum { CSR_FLOATS_WIDTH = 32 };

/* sums_v = sum_e data_e X_v(indices_e): X is [n][width], best aligned to a cache line. Every
 * sum is made of four that take turns, whatever the width, so that a vector's bits do not depend on how many
 * are beside it. */
typedef void csr_float_row(const uint32_t *indices, const float *data, uint64_t n_entries, const float *X,
                           float *sums);

/* Widths there are: the smallest that holds so many vectors (at most CSR_FLOATS_WIDTH). */
size_t csr_floats_width(size_t n_vectors);

/* The fastest product for this CPU and one of these widths. */
csr_float_row *csr_floats_row(size_t width);

/* Of all instruction sets that this CPU has, for tests: NULL past the last. */
csr_float_row *csr_floats_row_of(size_t instruction_set, size_t width);

#endif
