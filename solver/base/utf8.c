#include "solver/base/utf8.h"

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

bool utf8_is_valid(const char *text, size_t length) {
    const char *end = text + length;
    for (size_t step; text < end; text += step)
        if ((step = utf8_sequence(text, end)) == 0) return false;
    return true;
}

size_t utf8_of_latin1(const char *text, size_t length, char *out) {
    size_t n = 0;
    for (size_t i = 0; i < length; i++) {
        const unsigned char c = (unsigned char)text[i]; /* its value is its code point */
        if (c >= 0x80) out[n++] = (char)(0xC0 | c >> 6);
        out[n++] = (char)(c >= 0x80 ? 0x80 | (c & 0x3F) : c);
    }
    return n;
}

bool utf8_is_unfit(const char *at, size_t length) {
    const unsigned char *b = (const unsigned char *)at;
    if (length == 1) return b[0] < 0x20 || b[0] == 0x7F;
    if (length == 2) return b[0] == 0xC2 && b[1] < 0xA0;
    if (length != 3 || b[0] != 0xE2) return false;
    return (b[1] == 0x80 && (b[2] == 0x8E || b[2] == 0x8F || (b[2] >= 0xA8 && b[2] <= 0xAE))) ||
           (b[1] == 0x81 && b[2] >= 0xA6 && b[2] <= 0xA9);
}
