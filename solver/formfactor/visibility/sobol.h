/* Sobol's sequence in four dimensions (Sobol' 1967), in units of 2^-32: any 2^k consecutive points from a
 * multiple of 2^k on put the same number into every half, quarter ... of each axis, and nearly so into boxes.
 */
#ifndef LAMBERT_FORMFACTOR_VISIBILITY_SOBOL_H
#define LAMBERT_FORMFACTOR_VISIBILITY_SOBOL_H

#include <stdint.h>

enum { SOBOL_DIMENSIONS = 4, SOBOL_BITS = 32 };

/* The direction numbers v_k of each dimension. */
extern const uint32_t sobol_direction[SOBOL_DIMENSIONS][SOBOL_BITS];

/* A coordinate of a point: the exclusive or of v_k over the bits k of its index. The index may be split: the
 * coordinate of a ^ b is that of a ^ that of b. A shift by exclusive or with random bits makes it uniform in
 * [0, 2^32). */
static inline uint32_t sobol_coordinate(int dimension, uint32_t index) {
    uint32_t x = 0;
    for (; index != 0; index &= index - 1) x ^= sobol_direction[dimension][__builtin_ctz(index)];
    return x;
}

#endif
