#include "server/codec_json_reader.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static bool fail(json_reader *r, const char *fault) {
    if (r->fault == NULL) r->fault = fault;
    return false;
}

void json_begin(json_reader *r, const char *text, size_t length) {
    *r = (json_reader){.start = text, .at = text, .end = text + length};
}

void json_end(json_reader *r) {
    free(r->scratch);
    r->scratch = NULL;
    r->scratch_capacity = 0;
}

static inline void skip_space(json_reader *r) {
    const char *at = r->at;
    while (at < r->end && (*at == ' ' || *at == '\n' || *at == '\r' || *at == '\t')) at++;
    r->at = at;
}

json_kind json_look(json_reader *r) {
    if (r->fault != NULL) return JSON_NOTHING;
    skip_space(r);
    if (r->at == r->end) return JSON_NOTHING;
    switch (*r->at) {
    case '{':
        return JSON_OBJECT;
    case '[':
        return JSON_ARRAY;
    case '"':
        return JSON_TEXT;
    case 't':
    case 'f':
        return JSON_BOOLEAN;
    case 'n':
        return JSON_NULL;
    default:
        return *r->at == '-' || (*r->at >= '0' && *r->at <= '9') ? JSON_NUMBER : JSON_NOTHING;
    }
}

json_kind json_peek(json_reader *r) {
    json_kind kind = json_look(r);
    if (kind != JSON_NOTHING) return kind;
    if (r->at == r->end)
        fail(r, "the text ends where a value is expected");
    else
        fail(r, *r->at == 'N' || *r->at == 'I' ? "NaN and Infinity are not JSON numbers"
                                               : "a value is expected");
    return JSON_NOTHING;
}

static bool enter(json_reader *r, json_kind kind) {
    if (json_peek(r) != kind) return fail(r, "another kind of value is expected");
    if (r->depth == JSON_MAX_DEPTH) return fail(r, "nested more than 64 deep");
    r->depth++;
    r->at++;
    r->first = true;
    return true;
}

/* Over the comma before the next item; false at the closing bracket, which is consumed, or on a fault. */
static bool next(json_reader *r, char closing) {
    if (r->fault != NULL) return false;
    skip_space(r);
    if (r->at == r->end) return fail(r, "the text ends inside an array or object");
    if (*r->at == closing) {
        r->at++;
        r->depth--;
        r->first = false;
        return false;
    }
    if (!r->first) {
        if (*r->at != ',')
            return fail(r, closing == ']' ? "',' or ']' is expected" : "',' or '}' is expected");
        r->at++;
        skip_space(r);
        if (r->at < r->end && *r->at == closing) return fail(r, "a comma before a closing bracket");
    }
    r->first = false;
    return true;
}

bool json_enter_array(json_reader *r) {
    return enter(r, JSON_ARRAY);
}

bool json_next_element(json_reader *r) {
    return next(r, ']');
}

bool json_enter_object(json_reader *r) {
    return enter(r, JSON_OBJECT);
}

bool json_next_member(json_reader *r, json_slice *key) {
    if (!next(r, '}')) return false;
    skip_space(r);
    if (r->at == r->end || *r->at != '"') return fail(r, "a key in double quotes is expected");
    if (!json_read_text(r, key)) return false;
    skip_space(r);
    if (r->at == r->end || *r->at != ':') return fail(r, "':' is expected behind a key");
    r->at++;
    return true;
}

/* --- texts ------------------------------------------------------------------------------------------ */

size_t utf8_sequence(const char *at, const char *end) {
    const unsigned char *b = (const unsigned char *)at;
    size_t left = (size_t)(end - at);
    if (left == 0) return 0;
    if (b[0] < 0x80) return 1;
    size_t length = b[0] >= 0xF0 ? 4 : b[0] >= 0xE0 ? 3 : 2;
    if (b[0] < 0xC2 || b[0] > 0xF4 || left < length) return 0;
    for (size_t i = 1; i < length; i++)
        if ((b[i] & 0xC0) != 0x80) return 0;
    /* The second byte excludes overlong forms, surrogates and what lies beyond U+10FFFF. */
    if ((b[0] == 0xE0 && b[1] < 0xA0) || (b[0] == 0xED && b[1] > 0x9F) || (b[0] == 0xF0 && b[1] < 0x90) ||
        (b[0] == 0xF4 && b[1] > 0x8F))
        return 0;
    return length;
}

static bool read_hex4(const char *at, const char *end, unsigned *value) {
    if (end - at < 4) return false;
    *value = 0;
    for (int i = 0; i < 4; i++) {
        char c = at[i];
        unsigned digit;
        if (c >= '0' && c <= '9')
            digit = (unsigned)(c - '0');
        else if (c >= 'a' && c <= 'f')
            digit = (unsigned)(c - 'a') + 10;
        else if (c >= 'A' && c <= 'F')
            digit = (unsigned)(c - 'A') + 10;
        else
            return false;
        *value = *value * 16 + digit;
    }
    return true;
}

static char *put_utf8(char *to, unsigned code) {
    if (code < 0x80) {
        *to++ = (char)code;
    } else if (code < 0x800) {
        *to++ = (char)(0xC0 | code >> 6);
        *to++ = (char)(0x80 | (code & 0x3F));
    } else if (code < 0x10000) {
        *to++ = (char)(0xE0 | code >> 12);
        *to++ = (char)(0x80 | (code >> 6 & 0x3F));
        *to++ = (char)(0x80 | (code & 0x3F));
    } else {
        *to++ = (char)(0xF0 | code >> 18);
        *to++ = (char)(0x80 | (code >> 12 & 0x3F));
        *to++ = (char)(0x80 | (code >> 6 & 0x3F));
        *to++ = (char)(0x80 | (code & 0x3F));
    }
    return to;
}

/* One escape at r->at (behind the backslash) to *to. */
static bool read_escape(json_reader *r, char **to) {
    static const char letters[] = "\"\\/bfnrt", values[] = "\"\\/\b\f\n\r\t";
    if (r->at == r->end) return fail(r, "a text without its closing quote");
    const char *found = *r->at == '\0' ? NULL : strchr(letters, *r->at);
    if (found != NULL) {
        *(*to)++ = values[found - letters];
        r->at++;
        return true;
    }
    unsigned code, low;
    if (*r->at != 'u') return fail(r, "an unknown escape");
    if (!read_hex4(r->at + 1, r->end, &code)) return fail(r, "\\u needs four hexadecimal digits");
    r->at += 5;
    if (code >= 0xD800 && code <= 0xDFFF) {
        if (code > 0xDBFF || r->end - r->at < 6 || r->at[0] != '\\' || r->at[1] != 'u' ||
            !read_hex4(r->at + 2, r->end, &low) || low < 0xDC00 || low > 0xDFFF)
            return fail(r, "half a surrogate pair");
        code = 0x10000 + ((code - 0xD800) << 10) + (low - 0xDC00);
        r->at += 6;
    }
    *to = put_utf8(*to, code);
    return true;
}

bool json_read_text(json_reader *r, json_slice *text) {
    if (json_peek(r) != JSON_TEXT) return fail(r, "a text is expected");
    const char *begin = ++r->at;
    bool escaped = false;
    for (;;) {
        if (r->at == r->end) return fail(r, "a text without its closing quote");
        unsigned char c = (unsigned char)*r->at;
        if (c == '"') break;
        if (c < 0x20) return fail(r, "a control character inside a text");
        size_t step = 1;
        if (c == '\\') {
            escaped = true;
            step = 2;
            if (r->end - r->at < 2) return fail(r, "a text without its closing quote");
        } else if (c >= 0x80) {
            step = utf8_sequence(r->at, r->end);
            if (step == 0) return fail(r, "a text that is not valid UTF-8");
        }
        r->at += step;
    }
    const char *close = r->at;
    if (!escaped) {
        *text = (json_slice){begin, (size_t)(close - begin)};
        r->at = close + 1;
        return true;
    }
    /* What an escape stands for is never longer than the escape. */
    size_t room = (size_t)(close - begin);
    if (room > r->scratch_capacity) {
        char *scratch = realloc(r->scratch, room);
        if (scratch == NULL) {
            r->no_memory = true;
            return fail(r, "not enough memory for a text");
        }
        r->scratch = scratch;
        r->scratch_capacity = room;
    }
    char *to = r->scratch;
    for (r->at = begin; r->at < close;) {
        if (*r->at != '\\') {
            *to++ = *r->at++;
            continue;
        }
        r->at++;
        if (!read_escape(r, &to)) return false;
    }
    *text = (json_slice){r->scratch, (size_t)(to - r->scratch)};
    r->at = close + 1;
    return true;
}

/* --- numbers ---------------------------------------------------------------------------------------- */

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
    if (json_peek(r) != JSON_NUMBER) return fail(r, "a number is expected");
    const char *begin = r->at, *at = begin;
    uint64_t digits = 0;
    unsigned n_digits = 0;
    int64_t exponent = 0;
    *d = (decimal){.negative = *at == '-'};
    if (*at == '-') at++;
    if (!is_digit(*at)) {
        r->at = at;
        return fail(r, *at == 'I' ? "Infinity is not a JSON number" : "a digit is expected");
    }
    if (*at == '0' && is_digit(at[1])) {
        r->at = at;
        return fail(r, "a number with a leading zero");
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
            return fail(r, "a digit is expected behind the point");
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
            return fail(r, "a digit is expected in the exponent");
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

/* Whether these are eight digits, and their value: pairs of digits, then of pairs, then of those are put
 * together, all at once in one word. */
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

/* --- the rest --------------------------------------------------------------------------------------- */

static bool read_word(json_reader *r, const char *word) {
    size_t length = strlen(word);
    if ((size_t)(r->end - r->at) < length || memcmp(r->at, word, length) != 0)
        return fail(r, "true, false, null or another value is expected");
    r->at += length;
    return true;
}

bool json_read_boolean(json_reader *r, bool *value) {
    if (json_peek(r) != JSON_BOOLEAN) return fail(r, "true or false is expected");
    *value = *r->at == 't';
    return read_word(r, *value ? "true" : "false");
}

bool json_read_null(json_reader *r) {
    if (json_peek(r) != JSON_NULL) return fail(r, "null is expected");
    return read_word(r, "null");
}

bool json_skip(json_reader *r) {
    json_slice text;
    decimal number;
    bool boolean;
    switch (json_peek(r)) {
    case JSON_OBJECT:
        if (!json_enter_object(r)) return false;
        while (json_next_member(r, &text))
            if (!json_skip(r)) return false;
        return r->fault == NULL;
    case JSON_ARRAY:
        if (!json_enter_array(r)) return false;
        while (json_next_element(r))
            if (!json_skip(r)) return false;
        return r->fault == NULL;
    case JSON_TEXT:
        return json_read_text(r, &text);
    case JSON_NUMBER:
        return read_decimal(r, &number);
    case JSON_BOOLEAN:
        return json_read_boolean(r, &boolean);
    case JSON_NULL:
        return json_read_null(r);
    case JSON_NOTHING:
        break;
    }
    return false;
}

bool json_finish(json_reader *r) {
    if (r->fault != NULL) return false;
    skip_space(r);
    if (r->at != r->end) return fail(r, "something stands behind the end of the value");
    return true;
}
