/* Numbers of JSON texts, to the nearest value of their type. */
#include "solver/codec/json_reader.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* A number taken apart: (-1)^negative digits 10^exponent, digits cut after 19 of them (inexact then). */
typedef struct decimal {
    uint64_t digits;
    int64_t exponent;
    bool negative;
    bool inexact;
} decimal;

static inline bool is_digit(char c) {
    return (unsigned)(c - '0') < 10u;
}

/* The NUL behind the text ends every run of digits, so that `end` need not be asked for each. */
static bool read_decimal(json_reader *r, decimal *d) {
    if (json_peek(r) != JSON_NUMBER) return json_fail(r, "a number is expected");
    const char *begin = r->at, *at = begin;
    uint64_t digits = 0;
    unsigned n_digits = 0;
    int64_t exponent = 0;
    *d = (decimal){.negative = *at == '-'};
    if (*at == '-') at++;
    if (!is_digit(*at)) {
        r->at = at;
        return json_fail(r, *at == 'I' ? "Infinity is not a JSON number" : "a digit is expected");
    }
    if (*at == '0' && is_digit(at[1])) {
        r->at = at;
        return json_fail(r, "a number with a leading zero");
    }
    for (; is_digit(*at); at++) {
        if (n_digits < 19) {
            digits = digits * 10 + (uint64_t)(*at - '0');
            n_digits += digits > 0;
        } else {
            exponent++;
            d->inexact = true;
        }
    }
    if (*at == '.') {
        at++;
        if (!is_digit(*at)) {
            r->at = at;
            return json_fail(r, "a digit is expected behind the point");
        }
        for (; is_digit(*at); at++) {
            if (n_digits < 19) {
                digits = digits * 10 + (uint64_t)(*at - '0');
                n_digits += digits > 0;
                exponent--;
            } else {
                d->inexact = true;
            }
        }
    }
    if (*at == 'e' || *at == 'E') {
        at++;
        bool minus = *at == '-';
        if (*at == '-' || *at == '+') at++;
        if (!is_digit(*at)) {
            r->at = at;
            return json_fail(r, "a digit is expected in the exponent");
        }
        int64_t written = 0;
        for (; is_digit(*at); at++)
            if (written < 1000000000000) written = written * 10 + (*at - '0');
        exponent += minus ? -written : written;
    }
    d->digits = digits;
    d->exponent = exponent;
    r->number = (json_slice){begin, (size_t)(at - begin)};
    r->at = at;
    return true;
}

/* 10^0 ... 10^22 are exact in double. */
static const double power_of_ten[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                      1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
#define EXACT_POWERS 22

static inline double scale_by_ten(double value, int64_t exponent) {
    return exponent < 0 ? value / power_of_ten[-exponent] : value * power_of_ten[exponent];
}

bool json_read_double(json_reader *r, double *value) {
    decimal d;
    if (!read_decimal(r, &d)) return false;
    if (d.digits == 0 && !d.inexact) {
        *value = 0.0;
    } else if (!d.inexact && d.digits <= (uint64_t)1 << 53 && llabs(d.exponent) <= EXACT_POWERS) {
        /* Both operands are exact, so the one rounding is the right one (Clinger 1990). */
        *value = scale_by_ten((double)d.digits, d.exponent);
        if (d.negative) *value = -*value;
    } else {
        *value = strtod(r->number.bytes, NULL);
    }
    return true;
}

bool json_skip_number(json_reader *r) {
    decimal d;
    return read_decimal(r, &d);
}

bool json_read_float(json_reader *r, float *value) {
    decimal d;
    if (!read_decimal(r, &d)) return false;
    if (d.digits == 0 && !d.inexact) {
        *value = 0.0f;
        return true;
    }
    if (llabs(d.exponent) <= EXACT_POWERS) {
        /* Off by less than 4 units of 2^-53: digits beyond 53 bits, digits cut, one operation. When both ends
         * of that range round to the same float, so does the number. */
        double near = scale_by_ten((double)d.digits, d.exponent);
        float low = (float)(near * (1.0 - 0x1p-50)), high = (float)(near * (1.0 + 0x1p-50));
        if (low == high) {
            *value = d.negative ? -low : low;
            return true;
        }
    }
    *value = strtof(r->number.bytes, NULL);
    return true;
}

/* 10^-22 ... 10^22, of which those below 1 are rounded. */
static const double rounded_power[] = {
    1e-22, 1e-21, 1e-20, 1e-19, 1e-18, 1e-17, 1e-16, 1e-15, 1e-14, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8,
    1e-7,  1e-6,  1e-5,  1e-4,  1e-3,  1e-2,  1e-1,  1e0,   1e1,   1e2,   1e3,   1e4,   1e5,   1e6,  1e7,
    1e8,   1e9,   1e10,  1e11,  1e12,  1e13,  1e14,  1e15,  1e16,  1e17,  1e18,  1e19,  1e20,  1e21, 1e22};
_Static_assert(sizeof rounded_power / sizeof *rounded_power == 2 * EXACT_POWERS + 1, "one each");

/* True for eight digits, whose value is then combined in one word: digits to pairs, pairs to fours, fours to
 * eight. */
static inline bool eight_digits(const char *at, uint64_t *value) {
    uint64_t v;
    memcpy(&v, at, sizeof v);
    const uint64_t high = 0xF0F0F0F0F0F0F0F0u, zeros = 0x3030303030303030u;
    if ((v & high) != zeros || ((v + 0x0606060606060606u) & high) != zeros) return false;
    v = ((v & 0x0F0F0F0F0F0F0F0Fu) * (10 * 256 + 1)) >> 8;
    v = ((v & 0x00FF00FF00FF00FFu) * (100 * 65536 + 1)) >> 16;
    *value = ((v & 0x0000FFFF0000FFFFu) * (10000 * (UINT64_C(1) << 32) + 1)) >> 32;
    return true;
}

/* A number that is not negative, of at most 18 digits and with an exponent of two at most; NULL for any
 * other, and for what is none. Else where it ends. */
static inline const char *read_plain(const char *at, const char *end, float *value) {
    uint64_t digits = 0, eight;
    long exponent = 0;
    const char *begin = at;
    if (*at == '0' && is_digit(at[1])) return NULL;
    for (; is_digit(*at); at++) digits = digits * 10 + (uint64_t)(*at - '0');
    long n_digits = at - begin;
    if (n_digits == 0 || n_digits > 18) return NULL;
    if (*at == '.') {
        const char *point = ++at;
        if (end - at >= 8 && n_digits <= 10 && eight_digits(at, &eight)) {
            digits = digits * 100000000 + eight;
            at += 8;
        }
        for (; is_digit(*at); at++) digits = digits * 10 + (uint64_t)(*at - '0');
        exponent = point - at;
        n_digits -= exponent;
        if (exponent == 0 || n_digits > 18) return NULL;
    }
    if (*at == 'e' || *at == 'E') {
        at++;
        const bool minus = *at == '-';
        if (*at == '-' || *at == '+') at++;
        if (!is_digit(*at)) return NULL;
        long written = *at++ - '0';
        if (is_digit(*at)) written = written * 10 + (*at++ - '0');
        if (is_digit(*at)) return NULL;
        exponent += minus ? -written : written;
    }
    if (exponent < -EXACT_POWERS || exponent > EXACT_POWERS) return NULL;
    /* Off by less than 4 units of 2^-53, one for each of digits, power and product; as in json_read_float. */
    const double near = (double)digits * rounded_power[exponent + EXACT_POWERS];
    const float low = (float)(near * (1.0 - 0x1p-50)), high = (float)(near * (1.0 + 0x1p-50));
    if (low != high || !(low <= FLT_MAX)) return NULL;
    *value = low;
    return at;
}

size_t json_read_plain_floats(json_reader *r, float *values, size_t most) {
    size_t count = 0;
    if (r->fault != NULL) return 0;
    for (; count < most; count++) {
        const char *at = r->at;
        if (!r->first) {
            if (*at != ',') break;
            at++;
        }
        while (*at == ' ' || *at == '\n' || *at == '\r' || *at == '\t') at++;
        at = read_plain(at, r->end, &values[count]);
        if (at == NULL) break;
        r->at = at;
        r->first = false;
    }
    return count;
}
