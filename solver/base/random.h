/* Pseudorandom numbers: SplitMix64 (Steele, Lea and Flood 2014) and the linear congruential generator of
 * Knuth's MMIX. A store depends on every bit of them, so no constant here may change. */
#ifndef LAMBERT_BASE_RANDOM_H
#define LAMBERT_BASE_RANDOM_H

#include <stdint.h>

/* 2^64 over the golden ratio: the step of SplitMix64, which also keeps seeds of neighbours apart. */
#define RANDOM_STEP 0x9E3779B97F4A7C15u

/* The first half of random_mix, enough for one sampling offset. */
static inline uint64_t random_scatter(uint64_t x) {
    x = (x ^ x >> 30) * 0xBF58476D1CE4E5B9u;
    return x ^ x >> 27;
}

/* The finalizer of SplitMix64, a bijection. random_mix(seed + RANDOM_STEP * purpose) seeds a stream of its
 * own for each purpose. */
static inline uint64_t random_mix(uint64_t x) {
    x = random_scatter(x) * 0x94D049BB133111EBu;
    return x ^ x >> 31;
}

/* SplitMix64 by position: the value that follows state x. */
static inline uint64_t random_hash(uint64_t x) {
    return random_mix(x + RANDOM_STEP);
}

/* The state of a stream for one purpose of a generated scene, so that another count of draws for one purpose
 * leaves the others alone. */
static inline uint64_t random_stream(uint64_t seed, uint64_t purpose) {
    return random_hash(seed) + purpose;
}

/* Each call returns the next value of SplitMix64; any state is a seed. */
static inline uint64_t random_next(uint64_t *state) {
    return random_mix(*state += RANDOM_STEP);
}

/* x' = a x + c mod 2^64; only the high bits are random. */
static inline uint64_t random_lcg(uint64_t *state) {
    return *state = *state * 6364136223846793005u + 1442695040888963407u;
}

/* The high 53 bits as a multiple of 2^-53 in [0, 1). */
static inline double random_to_double(uint64_t bits) {
    return (double)(bits >> 11) * 0x1p-53;
}

/* The high 24 bits as a multiple of 2^-24 in [0, 1). */
static inline float random_to_float(uint64_t bits) {
    return (float)(bits >> 40) * 0x1p-24f;
}

/* Uniform in [0, 1), by SplitMix64. */
static inline double random_unit(uint64_t *state) {
    return random_to_double(random_next(state));
}

/* Uniform in [low, high), by SplitMix64. */
static inline double random_between(uint64_t *state, double low, double high) {
    return low + (high - low) * random_unit(state);
}

/* Uniform in [0, 1), by the congruential generator. */
static inline double random_lcg_unit(uint64_t *state) {
    return random_to_double(random_lcg(state));
}

#endif
