#include "store/status.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

const char *lam_status_text(lam_status status) {
#define STATUS_CASE(code, text)                                                                              \
    case code:                                                                                               \
        return text;
    switch (status) { LAM_STATUS_LIST(STATUS_CASE) }
#undef STATUS_CASE
    return "unknown status";
}

/* Removes the last UTF-8 character, which may be incomplete. */
static void cut_character(char *text) {
    size_t length = strlen(text);
    while (length > 0 && ((unsigned char)text[length - 1] & 0xC0) == 0x80) length--;
    if (length > 0) length--;
    text[length] = '\0';
}

lam_status status_fail(lam_error *error, lam_status code, const char *format, ...) {
    if (error == NULL) return code;
    va_list arguments;
    va_start(arguments, format);
    int length = vsnprintf(error->message, sizeof error->message, format, arguments);
    va_end(arguments);
    if (length < 0) error->message[0] = '\0';
    if (length >= (int)sizeof error->message) cut_character(error->message);
    for (char *c = error->message; *c != '\0'; c++)
        if ((unsigned char)*c < 0x20 || *c == 0x7f) *c = '?';
    error->status = code;
    return code;
}

bool size_multiply(size_t a, size_t b, size_t *product) {
    size_t result;
    if (__builtin_mul_overflow(a, b, &result)) return false;
    *product = result;
    return true;
}
