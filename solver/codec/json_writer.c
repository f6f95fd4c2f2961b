#include "solver/codec/json_writer.h"

#include "solver/base/parallel.h"
#include "solver/base/utf8.h"

#include <assert.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LEAST_POWER (-49)
#define GREATEST_POWER 59

/* 10^-49 ... 10^59, each rounded to the nearest double. */
#define UP(e) 1e##e
#define DOWN(e) 1e-##e
#define ROW_UP(d)                                                                                            \
    UP(d##0), UP(d##1), UP(d##2), UP(d##3), UP(d##4), UP(d##5), UP(d##6), UP(d##7), UP(d##8), UP(d##9)
#define ROW_DOWN(d)                                                                                          \
    DOWN(d##9), DOWN(d##8), DOWN(d##7), DOWN(d##6), DOWN(d##5), DOWN(d##4), DOWN(d##3), DOWN(d##2),          \
        DOWN(d##1), DOWN(d##0)
static const double powers[] = {ROW_DOWN(4), ROW_DOWN(3), ROW_DOWN(2), ROW_DOWN(1), 1e-9,     1e-8, 1e-7,
                                1e-6,        1e-5,        1e-4,        1e-3,        1e-2,     1e-1, ROW_UP(),
                                ROW_UP(1),   ROW_UP(2),   ROW_UP(3),   ROW_UP(4),   ROW_UP(5)};
#undef UP
#undef DOWN
#undef ROW_UP
#undef ROW_DOWN
_Static_assert(sizeof powers / sizeof powers[0] == GREATEST_POWER - LEAST_POWER + 1, "one power each");

static inline double power_of_ten(int exponent) {
    return powers[exponent - LEAST_POWER];
}

/* |value| = digits 10^exponent with the fewest digits that we can vouch for.
 * All of it is judged in y = |value| 10^s with 9 digits before the point: double carries y to about 3e-16,
 * that is 1e-6 of its unit, while half the gap to the next float (the smaller one, below a power of two) is
 * at least 2.9 of them; a decimal closer to y than that gap, less a margin of 1e-4, reads back as value, also
 * when it is read through a double. */
static inline void shortest_digits(float value, uint32_t *digits, int *exponent) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    uint32_t fraction = bits & 0x7FFFFFu;
    int binary = (int)(bits >> 23 & 0xFFu);
    double x = fabs((double)value);
    uint64_t x_bits;
    memcpy(&x_bits, &x, sizeof x_bits);

    /* Half the gap, in x: 2^(binary - 151), and half of that below a power of two. */
    int power_of_two = (binary == 0 ? 1 : binary) - 151 - (fraction == 0 && binary > 1);
    uint64_t gap_bits = (uint64_t)(power_of_two + 1023) << 52;
    double half_gap;
    memcpy(&half_gap, &gap_bits, sizeof half_gap);

    /* 10^decimal <= x < 10^(decimal + 1), from x = 1.... 2^magnitude and floor(magnitude log10(2)). */
    int magnitude = (int)(x_bits >> 52) - 1023;
    int decimal = (magnitude * 315653) >> 20;
    if (x >= power_of_ten(decimal + 1)) decimal++;
    int s = 8 - decimal;
    double scale = power_of_ten(s);
    double y = x * scale, gap = half_gap * scale - 1e-4;

    int64_t best = (int64_t)(y + 0.5); /* signed: one instruction converts it */
    int dropped = 0;
    int64_t unit = 10;
    for (int k = 1; k <= 9; k++, unit *= 10) {
        const int64_t rounded = (int64_t)(y * power_of_ten(-k) + 0.5);
        if (rounded == 0 || !(fabs((double)(rounded * unit) - y) < gap)) break;
        best = rounded;
        dropped = k;
    }
    *digits = (uint32_t)best;
    *exponent = dropped - s;
}

/* Eight digits of a value below 10^8, with zeros in front, the first in the lowest byte: halves, quarters,
 * then single digits of it side by side in one word. 10486 / 2^20 and 103 / 2^10 round down as 1/100 and 1/10
 * do, below 10^4 and below 100. */
static inline uint64_t eight_digits(uint32_t value) {
    uint64_t v = value / 10000 | (uint64_t)(value % 10000) << 32;
    uint64_t tens = (v * 10486 >> 20) & 0x0000007F0000007Fu;
    v = tens | (v - 100 * tens) << 16;
    tens = (v * 103 >> 10) & 0x000F000F000F000Fu;
    return (tens | (v - 10 * tens) << 8) | 0x3030303030303030u;
}

/* The digits of a value below 10^9: count of them, the first 8 (or all) in word, the last of 9 in ninth. */
typedef struct digits {
    uint64_t word;
    int count;
    char ninth;
} digits;

static inline digits digits_of(uint32_t value) {
    if (value >= 100000000) return (digits){eight_digits(value / 10), 9, (char)('0' + value % 10)};
    int count = 1;
    for (uint32_t power = 10; count < 8 && value >= power; power *= 10) count++;
    return (digits){eight_digits(value) >> 8 * (8 - count), count, '0'};
}

/* The digits from the k-th on, k at most 8: whole words are written, also behind the last that counts, and
 * nothing is read back, for which a CPU would wait. */
static inline void put_digits(char *at, const digits *d, int k) {
    const uint64_t rest = k < 8 ? d->word >> 8 * k : 0;
    memcpy(at, &rest, sizeof rest);
    at[8 - k] = d->ninth;
}

size_t json_write_float(char *to, float value) {
    static const char none[] = {'n', 'u', 'l', 'l'};
    if (!isfinite(value)) {
        memcpy(to, none, sizeof none);
        return sizeof none;
    }
    if (value == 0.0f) {
        *to = '0';
        return 1;
    }
    uint32_t number;
    int exponent;
    shortest_digits(value, &number, &exponent);
    const digits d = digits_of(number);
    const int count = d.count, point = count + exponent; /* digits before the decimal point */
    char *at = to;
    *at = '-';
    at += value < 0.0f;

    if (exponent >= 0 && point <= 9) { /* 1200 */
        put_digits(at, &d, 0);
        memset(at + count, '0', 8);
        at += point;
    } else if (point > 0 && point <= 9) { /* 12.34 */
        put_digits(at, &d, 0);
        put_digits(at + point + 1, &d, point);
        at[point] = '.';
        at += count + 1;
    } else if (point <= 0 && point > -3) { /* 0.0012 */
        memcpy(at, "0.00000", 8);
        at += 2 - point;
        put_digits(at, &d, 0);
        at += count;
    } else { /* 1.234e-7 */
        put_digits(at, &d, 0);
        if (count > 1) {
            put_digits(at + 2, &d, 1);
            at[1] = '.';
            at++;
        }
        at += count;
        *at++ = 'e';
        const int power = point - 1, magnitude = power < 0 ? -power : power;
        *at = '-';
        at += power < 0;
        if (magnitude > 9) *at++ = (char)('0' + magnitude / 10);
        *at++ = (char)('0' + magnitude % 10);
    }
    assert(at - to <= JSON_FLOAT_MAX);
    return (size_t)(at - to);
}

/* Pieces that are written at once; numbers of a long array, and of a piece, with the room that this takes at
 * most. */
enum {
    TOGETHER = 64,
    LONG = 32768,
    PIECE = 4096,
    PIECE_ROOM = PIECE * (JSON_FLOAT_MAX + 1) + JSON_FLOAT_ROOM
};

static bool reserve_floats(buffer *b, size_t count) {
    size_t bytes;
    return !__builtin_mul_overflow(count / PIECE + 1, (size_t)PIECE_ROOM, &bytes) &&
           bytes < SIZE_MAX - 2 - JSON_FLOAT_ROOM &&
           buffer_reserve(b, count < PIECE ? count * (JSON_FLOAT_MAX + 1) + 2 + JSON_FLOAT_ROOM : bytes + 2);
}

/* Numbers, each with a comma behind it; returns the end. */
static char *write_numbers(char *at, const float *values, size_t count) {
    for (size_t i = 0; i < count; i++) {
        at += json_write_float(at, values[i]);
        *at++ = ',';
    }
    return at;
}

/* Pieces of an array, written apart. */
typedef struct pieces {
    const float *values;
    size_t count;
    char *to;       /* piece p at p PIECE_ROOM */
    size_t *length; /* of each piece */
} pieces;

static void write_pieces(const void *job, size_t thread, size_t first, size_t last) {
    const pieces *p = job;
    (void)thread;
    for (size_t k = first; k < last; k++) {
        char *const to = p->to + k * PIECE_ROOM;
        const size_t left = p->count - k * PIECE;
        p->length[k] = (size_t)(write_numbers(to, p->values + k * PIECE, left < PIECE ? left : PIECE) - to);
    }
}

/* The numbers of a long array by the threads that are free, then pushed together. */
static char *write_together(char *at, const float *values, size_t count) {
    size_t length[TOGETHER];
    for (size_t first = 0; first < count; first += (size_t)TOGETHER * PIECE) {
        const size_t left = count - first,
                     some = left < (size_t)TOGETHER * PIECE ? left : (size_t)TOGETHER * PIECE;
        const pieces p = {values + first, some, at, length};
        const size_t n_pieces = (some + PIECE - 1) / PIECE;
        parallel_share(parallel_threads(), n_pieces, 1, write_pieces, &p);
        for (size_t k = 0; k < n_pieces; k++) {
            if (k > 0) memmove(at, p.to + k * PIECE_ROOM, length[k]);
            at += length[k];
        }
    }
    return at;
}

bool json_write_floats(buffer *b, const float *values, size_t count) {
    if (!reserve_floats(b, count)) return false;
    char *at = b->bytes + b->length;
    *at++ = '[';
    at = count < LONG || parallel_threads() < 2 ? write_numbers(at, values, count)
                                                : write_together(at, values, count);
    if (count > 0) at--;
    *at++ = ']';
    *at = '\0';
    b->length = (size_t)(at - b->bytes);
    return true;
}

bool json_write_double(buffer *b, double value) {
    char text[32];
    if (!isfinite(value)) return buffer_append(b, "null", 4);
    /* A number of at most 15 digits survives the way through a double, so that 15 digits without trailing
     * zeros reproduce it; denormal numbers have fewer. */
    int precision = fabs(value) < 1e-290 ? 1 : 15;
    do snprintf(text, sizeof text, "%.*g", precision, value);
    while (precision++ < 17 && strtod(text, NULL) != value);
    return buffer_append_text(b, text);
}

bool json_write_doubles(buffer *b, const double *values, size_t count) {
    bool written = buffer_append(b, "[", 1);
    for (size_t i = 0; written && i < count; i++)
        written = (i == 0 || buffer_append(b, ",", 1)) && json_write_double(b, values[i]);
    return written && buffer_append(b, "]", 1);
}

bool json_write_text(buffer *b, const char *text) {
    const char *end = text + strlen(text);
    bool written = buffer_append(b, "\"", 1);
    while (written && text < end) {
        size_t length = utf8_sequence(text, end);
        unsigned char c = (unsigned char)*text;
        if (length == 0) {
            written = buffer_append(b, "?", 1);
            length = 1;
        } else if (c == '"' || c == '\\') {
            written = buffer_append(b, "\\", 1) && buffer_append(b, text, 1);
        } else if (c < 0x20) {
            written = buffer_printf(b, "\\u%04x", c);
        } else {
            written = buffer_append(b, text, length);
        }
        text += length;
    }
    return written && buffer_append(b, "\"", 1);
}
