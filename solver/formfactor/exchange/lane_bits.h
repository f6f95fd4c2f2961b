/* The lanes of a vector of eight as bits. Knows no segments. */
#ifndef LAMBERT_FORMFACTOR_EXCHANGE_LANE_BITS_H
#define LAMBERT_FORMFACTOR_EXCHANGE_LANE_BITS_H

#include <stdint.h>
#include <string.h>

typedef signed char lane_bytes __attribute__((vector_size(8)));

/* Bit k is that of lane k, which is -1 or 0: byte k keeps its bit k, and the product adds all bytes. The
 * lanes come by a pointer, as vectors are passed in other registers by each instruction set. */
static inline __attribute__((always_inline)) unsigned lane_bits(const lane_bytes *lanes) {
    uint64_t bytes;
    memcpy(&bytes, lanes, sizeof bytes);
    return (unsigned)((bytes & 0x8040201008040201u) * 0x0101010101010101u >> 56);
}

#endif
