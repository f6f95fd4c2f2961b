/* Products of sparse rows with vectors in double that lie side by side: csr_floats.h where digits count. */
#ifndef LAMBERT_LINALG_CSR_DOUBLES_H
#define LAMBERT_LINALG_CSR_DOUBLES_H

#include "solver/linalg/csr.h"

/* Vectors side by side at most. */
enum { CSR_DOUBLES_WIDTH = 16 };

/* sums_v = sum_e data_e X_v(indices_e): X is [n][width], best aligned to a cache line. Every
 * sum is made of four that take turns, whatever the width, so that a vector's bits do not depend on how many
 * are beside it. */
typedef void csr_double_row(const uint32_t *indices, const float *data, uint64_t n_entries, const double *X,
                            double *sums);

/* How often a term of such a sum is rounded at most: when it is made (without FMA), with every addition of
 * its quarter, and twice more. */
static inline double csr_doubles_roundings(uint64_t n_entries) {
    return (double)(n_entries / 4 + 4);
}

/* Widths there are: the smallest that holds so many vectors (at most CSR_DOUBLES_WIDTH). */
size_t csr_doubles_width(size_t n_vectors);

/* The fastest product for this CPU and one of these widths. */
csr_double_row *csr_doubles_row(size_t width);

/* Of all instruction sets that this CPU has, for tests: NULL past the last. */
csr_double_row *csr_doubles_row_of(size_t instruction_set, size_t width);

#endif
