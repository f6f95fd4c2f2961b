/* The strict readers behind options.h: a whole text, a finite number, nothing else. */
#include "solver/console/options.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

lam_status option_number(const char *what, const char *text, double *value, lam_error *error) {
    lam_status status = LAM_OK;
    char *end = NULL;
    /* strtod would skip spaces and read "inf", "nan" and hexadecimal: none of these is meant here. */
    if (text[0] == '\0' || strspn(text, "+-.0123456789eE") != strlen(text))
        FAIL(error, LAM_ERR_ARGUMENT, "%s %s: not a number", what, text);
    double number = strtod(text, &end);
    if (*end != '\0') FAIL(error, LAM_ERR_ARGUMENT, "%s %s: not a number", what, text);
    if (!isfinite(number)) FAIL(error, LAM_ERR_ARGUMENT, "%s %s: too large for a number", what, text);
    *value = number;
done:
    return status;
}

lam_status option_count(const char *what, const char *text, uint64_t *value, lam_error *error) {
    lam_status status = LAM_OK;
    if (text[0] == '\0' || strspn(text, "0123456789") != strlen(text))
        FAIL(error, LAM_ERR_ARGUMENT, "%s %s: not a whole number", what, text);
    errno = 0;
    unsigned long long number = strtoull(text, NULL, 10);
    if (errno == ERANGE || number >= OPTION_AUTO)
        FAIL(error, LAM_ERR_ARGUMENT, "%s %s: too large for a number", what, text);
    *value = number;
done:
    return status;
}

lam_status option_size(const char *what, const char *text, uint64_t *bytes, lam_error *error) {
    lam_status status = LAM_OK;
    size_t length = strlen(text);
    static const char suffixes[] = "KMG";
    const char *suffix =
        length == 0 ? NULL : memchr(suffixes, toupper((unsigned char)text[length - 1]), sizeof suffixes - 1);
    char digits[32];
    if (suffix != NULL) length--;
    if (length == 0 || length >= sizeof digits || strspn(text, "0123456789.") < length)
        FAIL(error, LAM_ERR_ARGUMENT, "%s %s: not a size such as 500M or 16G", what, text);
    memcpy(digits, text, length);
    digits[length] = '\0';
    char *end = NULL;
    double number = strtod(digits, &end);
    if (*end != '\0') FAIL(error, LAM_ERR_ARGUMENT, "%s %s: not a size such as 500M or 16G", what, text);
    if (suffix != NULL) number = ldexp(number, 10 * (int)(suffix - suffixes + 1));
    if (number < 1 || number >= 0x1p60)
        FAIL(error, LAM_ERR_ARGUMENT, "%s %s: must be at least 1 byte and below 2^60", what, text);
    *bytes = (uint64_t)number;
done:
    return status;
}

lam_status option_numbers(const char *what, const char *text, size_t count, bool exactly, double *values,
                          size_t *found, lam_error *error) {
    lam_status status = LAM_OK;
    double read[16];
    size_t n = 0;
    for (const char *rest = text;; n++) {
        size_t length = strcspn(rest, ",");
        char piece[64];
        if (n == count || n == sizeof read / sizeof read[0])
            FAIL(error, LAM_ERR_ARGUMENT, "%s %s: more than %zu numbers", what, text, count);
        if (length >= sizeof piece) FAIL(error, LAM_ERR_ARGUMENT, "%s %s: not a number", what, text);
        memcpy(piece, rest, length);
        piece[length] = '\0';
        double value = 0;
        if (option_number(what, piece, &value, NULL) != LAM_OK)
            FAIL(error, LAM_ERR_ARGUMENT, "%s %s: not %s", what, text,
                 count == 1 ? "a number" : "numbers between commas");
        read[n] = value;
        if (rest[length] == '\0') break;
        rest += length + 1;
    }
    n++;
    if (exactly && n != count)
        FAIL(error, LAM_ERR_ARGUMENT, "%s %s: %zu numbers, needs %zu", what, text, n, count);
    memcpy(values, read, n * sizeof *values);
    if (found != NULL) *found = n;
done:
    return status;
}

bool option_among(const char *word, const char *words) {
    size_t length = strlen(word);
    if (length == 0 || strchr(word, '|') != NULL) return false;
    for (const char *rest = words; rest != NULL; rest = strchr(rest, '|')) {
        if (*rest == '|') rest++;
        if (strncmp(rest, word, length) == 0 && (rest[length] == '|' || rest[length] == '\0')) return true;
    }
    return false;
}
