/* Reads values of options: a whole text, a finite number, nothing else. */
#include "solver/base/options/options.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

lam_status option_number(const char *what, const char *text, double *value, lam_error *error) {
    lam_status status = LAM_OK;
    char *end = NULL;
    if (strchr(text, ',') != NULL && strspn(text, "+-,.0123456789eE") == strlen(text))
        FAIL(error, LAM_ERR_ARGUMENT, "%s %s: not a number; the decimal mark is a point", what, text);
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
    if (text[0] == '-' && text[1] != '\0' && strspn(text + 1, "0123456789") == strlen(text + 1))
        FAIL(error, LAM_ERR_ARGUMENT, "%s %s: must not be negative", what, text);
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
    static const char units[] = "KMGT";
    const size_t length = strspn(text, "0123456789.");
    const char *suffix = text + length, *unit = NULL;
    char digits[32];
    double number = 0;
    char *end = digits;
    if (*suffix != '\0') {
        unit = strchr(units, toupper((unsigned char)*suffix));
        suffix += strcasecmp(suffix + 1, "iB") == 0 ? 3 : strcasecmp(suffix + 1, "B") == 0 ? 2 : 1;
    }
    if (length > 0 && length < sizeof digits) {
        memcpy(digits, text, length);
        digits[length] = '\0';
        number = strtod(digits, &end);
    }
    if (end == digits || *end != '\0' || *suffix != '\0' || (text[length] != '\0' && unit == NULL))
        FAIL(error, LAM_ERR_ARGUMENT, "%s %s: not a size such as 500M or 16G", what, text);
    if (unit != NULL) number = ldexp(number, 10 * (int)(unit - units + 1));
    if (number < 1 || number >= 0x1p60)
        FAIL(error, LAM_ERR_ARGUMENT, "%s %s: must be at least 1 byte and below 2^60", what, text);
    *bytes = (uint64_t)number;
done:
    return status;
}

lam_status option_numbers(const char *what, const char *text, size_t count, bool exactly, double *values,
                          size_t *found, lam_error *error) {
    lam_status status = LAM_OK;
    size_t n = 0;
    double *read = memory_allocate(count, sizeof *read, what, error);
    if (read == NULL) TRY(LAM_ERR_MEMORY);
    for (const char *rest = text;; n++) {
        size_t length = strcspn(rest, ",");
        char piece[64];
        if (n == count) FAIL(error, LAM_ERR_ARGUMENT, "%s %s: more than %zu numbers", what, text, count);
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
    free(read);
    return status;
}

unsigned option_place(const char *word, const char *words) {
    const size_t length = strlen(word);
    unsigned place = 0;
    for (const char *at = words;; place++) {
        const size_t n = strcspn(at, "|");
        if (n == length && n > 0 && strncmp(at, word, n) == 0) return place;
        if (at[n] == '\0') return place + 1;
        at += n + 1;
    }
}

void option_word(unsigned place, const char *words, char word[OPTION_WORD_BYTES]) {
    const char *at = words;
    while (place-- > 0 && strchr(at, '|') != NULL) at = strchr(at, '|') + 1;
    snprintf(word, OPTION_WORD_BYTES, "%.*s", (int)strcspn(at, "|"), at);
}

bool option_among(const char *word, const char *words) {
    unsigned n = 1;
    for (const char *c = words; *c != '\0'; c++) n += *c == '|';
    return option_place(word, words) < n;
}

static lam_status limits_check(const option_row *row, const char *what, const char *text, double value,
                               lam_error *error) {
    lam_status status = LAM_OK;
    if (row->least == 0 && row->most == 0 && !row->above) return LAM_OK;
    const bool has_most = row->most > row->least;
    const bool too_low = row->above ? value <= row->least : value < row->least;
    const bool too_high = has_most && (row->below ? value >= row->most : value > row->most);
    if (!too_low && !too_high) return LAM_OK;
    if (has_most)
        FAIL(error, LAM_ERR_ARGUMENT, "%s %s: must be %s %.12g and %s %.12g", what, text,
             row->above ? "above" : "at least", row->least, row->below ? "below" : "at most", row->most);
    FAIL(error, LAM_ERR_ARGUMENT, "%s %s: must be %s %.12g", what, text, row->above ? "above" : "at least",
         row->least);
done:
    return status;
}

static lam_status choice_check(const option_row *row, const char *what, const char *text, lam_error *error) {
    lam_status status = LAM_OK;
    char words[256];
    if (option_among(text, row->choices)) return LAM_OK;
    snprintf(words, sizeof words, "%s", row->choices);
    for (char *c = words; *c != '\0'; c++)
        if (*c == '|') *c = ' ';
    FAIL(error, LAM_ERR_ARGUMENT, "%s %s: must be one of: %s", what, text, words);
done:
    return status;
}

lam_status option_read(const option_row *row, const char *text, void *field, lam_error *error) {
    lam_status status = LAM_OK;
    option_list *list = field;
    char what[64];
    double number = 0;
    uint64_t count = 0;
    snprintf(what, sizeof what, "--%s", row->name);
    switch (row->kind) {
    case OPTION_FLAG:
        *(bool *)field = true;
        break;
    case OPTION_TEXT:
        if (text[0] == '\0') FAIL(error, LAM_ERR_ARGUMENT, "%s: needs a value that is not empty", what);
        *(const char **)field = text;
        break;
    case OPTION_LIST:
        if (list->count == OPTION_LIST_MAX)
            FAIL(error, LAM_ERR_ARGUMENT, "%s %s: given more than %d times", what, text, OPTION_LIST_MAX);
        list->items[list->count++] = text;
        break;
    case OPTION_NUMBER:
        TRY(option_number(what, text, &number, error));
        TRY(limits_check(row, what, text, number, error));
        *(double *)field = number;
        break;
    case OPTION_COUNT_AUTO:
    case OPTION_COUNT:
        if (row->kind == OPTION_COUNT_AUTO && strcmp(text, "auto") == 0) {
            *(uint64_t *)field = OPTION_AUTO;
            break;
        }
        TRY(option_count(what, text, &count, error));
        TRY(limits_check(row, what, text, (double)count, error));
        *(uint64_t *)field = count;
        break;
    case OPTION_SIZE:
        TRY(option_size(what, text, &count, error));
        TRY(limits_check(row, what, text, (double)count, error));
        *(uint64_t *)field = count;
        break;
    case OPTION_OPTIONAL:
        if (text == NULL) text = "";
        if (text[0] != '\0') TRY(choice_check(row, what, text, error));
        *(const char **)field = text;
        break;
    case OPTION_CHOICE:
        TRY(choice_check(row, what, text, error));
        *(const char **)field = text;
        break;
    case OPTION_SWITCH:
        if (text != NULL && text[0] != '\0') TRY(choice_check(row, what, text, error));
        *(unsigned *)field = text == NULL || text[0] == '\0' ? 1 : 2 + option_place(text, row->choices);
        break;
    case OPTION_WORD:
        TRY(choice_check(row, what, text, error));
        *(unsigned *)field = option_place(text, row->choices);
        break;
    case OPTION_CUSTOM:
        TRY(row->parse(text, field, error));
        break;
    }
done:
    return status;
}
