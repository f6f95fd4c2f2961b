/* Between vectors, each with its elements side by side, and rows of LANES numbers, one of each vector: the
 * loops of hierarchical_wide.c. Each lane has the bits that a vector has alone. */
#ifndef LAMBERT_OPERATOR_LANE_ROWS_H
#define LAMBERT_OPERATOR_LANE_ROWS_H

#include "solver/base/cpu.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { LANES = 16 };

/* Up to LANES numbers of each vector that lie side by side, from `first` on, and the rows that they belong
 * to. */
typedef struct lane_block {
    size_t first, count;
    uint32_t row[LANES];
} lane_block;

/* P = left X + factor lift of a row, or, where lift is NULL, left X alone; adjoint, left X + factor left^2.
 */
typedef struct lane_bounce {
    bool adjoint;
    const float *left, *lift; /* by row */
    const float *factor;      /* [LANES], aligned as LANES floats */
} lane_bounce;

/* X and P are aligned to a cache line. */
typedef struct lane_kernels {
    /* X_row = by_row from_v of the elements of a block, by = NULL: 1; LANES numbers at each from_v are
     * read. */
    void (*put)(const lane_block *b, const float *const from[LANES], const float *by, float *X);
    /* sums_v = sum_p by_p X_pv, each in the order of mean_correction_sum. */
    void (*sum)(const float *by, const float *X, size_t count, double sums[LANES]);
    /* P [vector][element] of the elements of a block, 0 behind them. Adding 0 makes -0 one 0, as in a product
     * with one vector, to which a factor of 0 adds nothing. */
    void (*take)(const lane_bounce *bounce, const lane_block *b, const float *X, float P[LANES][LANES]);
    /* out = E + P of the elements of a block and of the first `count` vectors, or E where rho says that
     * nothing is reflected; LANES numbers of rho and E are read. */
    void (*radiosity)(const lane_block *b, size_t count, const float *rho, const float *const E[LANES],
                      const float P[LANES][LANES], float *const out[LANES]);
} lane_kernels;

const lane_kernels *lane_kernels_of(cpu_level level);

#endif
