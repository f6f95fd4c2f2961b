/* The shortest decimals of floats, in the way of Schubfach (R. Giulietti, The Schubfach way to render
 * doubles, 2020), with powers of ten of 64 bits: one product for the number and one for each end of the
 * interval that rounds to it. The numbers of an answer differ in length from one to the next, so that digits
 * are found in vectors and placed without a branch that depends on them. */
#include "solver/base/cpu.h"
#include "solver/codec/json_writer.h"

#include <string.h>

/* Numbers whose decimals are found at once. */
enum { FLOATS = 32 };

/* A decimal, d.dddddddd 10^power: its first eight digits, each in a byte, the first in the lowest; and the
 * ninth, with power + STEPS in the bytes above. */
typedef struct decimal {
    uint64_t digits, rest;
} decimal;

/* k + STEPS is above zero for every power of ten that is used. */
enum { STEPS = 64, GREATEST_STEP = STEPS + 31 };

/* The one float whose shortest decimal, 7.038531e-26, is so close to the middle to a neighbour that it is
 * rounded to the middle by who reads it as a double, and then to the neighbour. It is written longer. */
#define ROUNDED_TWICE 0x15AE43FDu

/* ceil(10^e 2^(63 - floor(log2(10^e)))) for e = -31 ... 45: the leading 64 bits. */
static const uint64_t powers[] = {
    0x81ceb32c4b43fcf5, 0xa2425ff75e14fc32, 0xcad2f7f5359a3b3f, 0xfd87b5f28300ca0e, 0x9e74d1b791e07e49,
    0xc612062576589ddb, 0xf79687aed3eec552, 0x9abe14cd44753b53, 0xc16d9a0095928a28, 0xf1c90080baf72cb2,
    0x971da05074da7bef, 0xbce5086492111aeb, 0xec1e4a7db69561a6, 0x9392ee8e921d5d08, 0xb877aa3236a4b44a,
    0xe69594bec44de15c, 0x901d7cf73ab0acda, 0xb424dc35095cd810, 0xe12e13424bb40e14, 0x8cbccc096f5088cc,
    0xafebff0bcb24aaff, 0xdbe6fecebdedd5bf, 0x89705f4136b4a598, 0xabcc77118461cefd, 0xd6bf94d5e57a42bd,
    0x8637bd05af6c69b6, 0xa7c5ac471b478424, 0xd1b71758e219652c, 0x83126e978d4fdf3c, 0xa3d70a3d70a3d70b,
    0xcccccccccccccccd, 0x8000000000000000, 0xa000000000000000, 0xc800000000000000, 0xfa00000000000000,
    0x9c40000000000000, 0xc350000000000000, 0xf424000000000000, 0x9896800000000000, 0xbebc200000000000,
    0xee6b280000000000, 0x9502f90000000000, 0xba43b74000000000, 0xe8d4a51000000000, 0x9184e72a00000000,
    0xb5e620f480000000, 0xe35fa931a0000000, 0x8e1bc9bf04000000, 0xb1a2bc2ec5000000, 0xde0b6b3a76400000,
    0x8ac7230489e80000, 0xad78ebc5ac620000, 0xd8d726b7177a8000, 0x878678326eac9000, 0xa968163f0a57b400,
    0xd3c21bcecceda100, 0x84595161401484a0, 0xa56fa5b99019a5c8, 0xcecb8f27f4200f3a, 0x813f3978f8940985,
    0xa18f07d736b90be6, 0xc9f2c9cd04674edf, 0xfc6f7c4045812297, 0x9dc5ada82b70b59e, 0xc5371912364ce306,
    0xf684df56c3e01bc7, 0x9a130b963a6c115d, 0xc097ce7bc90715b4, 0xf0bdc21abb48db21, 0x96769950b50d88f5,
    0xbc143fa4e250eb32, 0xeb194f8e1ae525fe, 0x92efd1b8d0cf37bf, 0xb7abc627050305ae, 0xe596b7b0c643c71a,
    0x8f7e32ce7bea5c70, 0xb35dbf821ae4f38c,
};

/* which ? a : b, for 1 and 0, without a branch. */
static inline uint64_t choose(uint64_t which, uint64_t a, uint64_t b) {
    return b ^ ((a ^ b) & -which);
}

/* STEPS + floor(log10(2^q)), or of 3/4 2^q where half of the interval is below a power of two, for q =
 * exponent - 150 from -149 to 104; the factors are log10(2) and log10(4/3) in units of 2^-20. */
static inline uint64_t floor_log10(uint64_t exponent, uint64_t at_power) {
    return (exponent * 315653 + ((uint64_t)STEPS << 20) - 150 * 315653 - 131008 * at_power) >> 20;
}

/* floor(log2(10^-k)) of k + STEPS, modulo 2^64; the factor is log2(10) in units of 2^-19. */
static inline uint64_t floor_log2_of_power(uint64_t k) {
    return (((STEPS - k) * 1741647 + ((uint64_t)256 << 19)) >> 19) - 256;
}

/* floor(power factor / 2^64), made odd where the product is no multiple of that, so that it compares with
 * even numbers as the product does. As the power was rounded up by less than one, the product is a multiple
 * if its lower 64 bits are below 2^32. */
static inline uint64_t multiply_to_odd(uint64_t power, uint64_t factor) {
    const uint64_t low = (power & 0xFFFFFFFFu) * factor;
    const uint64_t sum = (power >> 32) * factor + (low >> 32);
    return sum >> 32 | ((sum & 0xFFFFFFFFu) + 0xFFFFFFFFu) >> 32;
}

/* Eight digits of a value below 10^8, with zeros in front, the first in the lowest byte: halves, quarters,
 * then single digits of it side by side in one word. 3518437209 / 2^45, 10486 / 2^20 and 103 / 2^10 round
 * down as 1/10000, 1/100 and 1/10 do, below 10^8, 10^4 and 100. */
static inline uint64_t eight_digits(uint64_t value) {
    const uint64_t high = value * 3518437209u >> 45;
    uint64_t v = high | (value - 10000 * high) << 32;
    uint64_t tens = (v * 10486 >> 20) & 0x0000007F0000007Fu;
    v = tens | (v - 100 * tens) << 16;
    tens = (v * 103 >> 10) & 0x000F000F000F000Fu;
    return tens | (v - 10 * tens) << 8;
}

#define CPU_KERNELS "solver/codec/json_float_kernels.inc"
#include "solver/base/cpu_kernels.inc"

/* e10, e-7 and the like. */
static inline char *place_power(char *at, int power) {
    const bool below = power < 0, two = power > 9 || power < -9;
    const int size = below ? -power : power;
    at[0] = 'e';
    at[1] = '-';
    at += 1 + below;
    at[0] = (char)('0' + size / 10);
    at[two] = (char)('0' + size % 10);
    return at + 1 + two;
}

/* 1200, 12.34 and 0.0012, or 1.234e-7, with the sign of `bits`. Whole words are written, also behind the last
 * digit that counts, and nothing is read back, for which a CPU would wait. */
static inline char *place(char *at, uint32_t bits, const decimal *d) {
    const uint32_t ninth = d->rest & 0xFF;
    const int count = (int)choose(ninth > 0, 9, 8 - (uint32_t)__builtin_clzll(d->digits | 1) / 8);
    const int power = (int)(d->rest >> 8) - STEPS;
    const bool plain = power >= -3 && power < 9;
    const int point = plain ? power + 1 : 1; /* digits before the point, where it stands among them */
    const bool among = (uint32_t)point - 1 < 8;
    const int split = (int)choose(among, (uint32_t)point, 8);
    const uint64_t text = d->digits | 0x3030303030303030u, behind = text >> 4 * split >> 4 * split;
    *at = '-';
    at += bits >> 31;
    memcpy(at, "0.00000", 8);
    at += (2 - point) * (point <= 0);
    memcpy(at, &text, 8);
    at[split] = '.';
    memcpy(at + split + among, &behind, 8);
    at[8 + among] = (char)('0' + ninth);
    at += (count > point ? count : point) + ((point > 0) & (count > point));
    return plain ? at : place_power(at, power);
}

/* Zero, of either sign, and numbers that are not finite. */
static char *place_special(char *at, uint32_t magnitude) {
    const bool zero = magnitude == 0;
    const uint32_t text = zero ? 0x20202030u : 0x6C6C756Eu; /* a zero and blanks, or null */
    memcpy(at, &text, sizeof text);
    return at + (zero ? 1 : 4);
}

typedef void find_decimals(const uint32_t *restrict bits, decimal *restrict out);

char *json_write_numbers(char *to, const float *values, size_t count) {
    static find_decimals *const finds[] =
        CPU_TABLE(find_decimals_portable, find_decimals_avx2, find_decimals_avx512);
    char *at = to;
    find_decimals *const find = finds[cpu_best()];
    for (size_t first = 0; first < count; first += FLOATS) {
        const size_t now = count - first < FLOATS ? count - first : FLOATS;
        uint32_t bits[FLOATS] = {0};
        decimal found[FLOATS];
        memcpy(bits, values + first, now * sizeof *bits);
        find(bits, found);
        for (size_t i = 0; i < now; i++) {
            const uint32_t magnitude = bits[i] & 0x7FFFFFFFu;
            at = magnitude - 1 < 0x7F800000u - 1 ? place(at, bits[i], &found[i])
                                                 : place_special(at, magnitude);
            *at++ = ',';
        }
    }
    return at;
}
