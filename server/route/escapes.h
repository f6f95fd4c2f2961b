/* Escapes %XX of targets (RFC 3986, 2.1). */
#ifndef LAMBERT_SERVER_ROUTE_ESCAPES_H
#define LAMBERT_SERVER_ROUTE_ESCAPES_H

#include <stddef.h>

static inline int hex_digit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

/* The byte of the escape that text begins with; -1: it begins with none. */
static inline int escape_byte(const char *text, size_t length) {
    if (length < 3 || text[0] != '%') return -1;
    const int high = hex_digit(text[1]), low = hex_digit(text[2]);
    return high < 0 || low < 0 ? -1 : high * 16 + low;
}

#endif
