/* IEEE half precision (f16); in software bit for bit what the instructions of the processor give. */
#ifndef LAMBERT_BASE_HALF_H
#define LAMBERT_BASE_HALF_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

/* Greatest value of f16. */
#define HALF_MAX 65504.0f

static inline uint32_t float_bits(float x) {
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static inline float float_of_bits(uint32_t bits) {
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* The nearest f16, ties to even; from 65520 on infinity. NaN stays NaN. */
static inline uint16_t half_of_float(float x) {
    const uint32_t bits = float_bits(x), sign = bits >> 16 & 0x8000u, magnitude = bits & 0x7fffffffu;
    if (magnitude > 0x7f800000u) return (uint16_t)(sign | 0x7e00u);
    if (magnitude >= 0x477ff000u) return (uint16_t)(sign | 0x7c00u);
    if (magnitude <
        0x38800000u) /* a multiple of 2^-24: the sum with .5 rounds it to whole ones in its last bits */
        return (uint16_t)(sign | (float_bits(float_of_bits(magnitude) + 0.5f) - 0x3f000000u));
    /* Rebias the exponent by 112, round at bit 13. */
    return (uint16_t)(sign | (magnitude - 0x38000000u + 0xfffu + (magnitude >> 13 & 1)) >> 13);
}

static inline float float_of_half(uint16_t half) {
    const uint32_t sign = (uint32_t)(half & 0x8000u) << 16, magnitude = half & 0x7fffu;
    if (magnitude >= 0x7c00u) return float_of_bits(sign | 0x7f800000u | magnitude << 13);
    /* The exponent is 112 too small for a float; the multiplication also normalizes subnormal numbers. */
    return float_of_bits(sign | float_bits(float_of_bits(magnitude << 13) * 0x1p112f));
}

/* The nearest f16 of each of count floats, [count] numbers of 2 bytes to any address, also to that of x
 * itself; by instructions where there are some, which keep more of a NaN. */
void halves_of_floats(const float *x, size_t count, void *halves);

#endif
