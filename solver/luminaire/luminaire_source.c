#include "solver/luminaire/luminaire_source.h"

#include "solver/base/array_grow.h"
#include "solver/base/utf8.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static bool is_blank(char c) {
    return c == ' ' || (c >= '\t' && c <= '\r');
}

/* The mark that ends a text of CP/M and DOS. */
enum { END_OF_TEXT = 0x1A };

lam_status luminaire_source_open(const char *name, const char *text, size_t length, luminaire_source *out,
                                 lam_error *error) {
    if (length > LUMINAIRE_BYTES_MOST)
        return status_fail(error, LAM_ERR_FORMAT,
                           "%s: has %zu bytes, more than the %zu MiB that a luminaire file may have", name,
                           length, LUMINAIRE_BYTES_MOST >> 20);
    return luminaire_source_begin(name, text, length, out, error);
}

lam_status luminaire_source_begin(const char *name, const char *text, size_t length, luminaire_source *out,
                                  lam_error *error) {
    lam_status status = LAM_OK;
    luminaire_source s = {.name = name, .text = text, .end = text + length};
    size_t ends = 0, doubled = 0;
    const bool marked = length >= 2 && (memcmp(text, "\xff\xfe", 2) == 0 || memcmp(text, "\xfe\xff", 2) == 0);
    if (marked || (length >= 4 && (text[0] == '\0') != (text[1] == '\0') &&
                   (text[0] == '\0') == (text[2] == '\0') && (text[1] == '\0') == (text[3] == '\0')))
        FAIL(error, LAM_ERR_FORMAT, "%s: is a text in UTF-16; save it as UTF-8 or Latin-1", name);
    if (length >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0) s.text += 3;
    const char *mark = memchr(s.text, END_OF_TEXT, (size_t)(s.end - s.text));
    if (mark != NULL) s.end = mark;
    while (s.end > s.text && (is_blank(s.end[-1]) || s.end[-1] == '\0')) s.end--;
    if (s.end == s.text) FAIL(error, LAM_ERR_FORMAT, "%s: the file is empty", name);
    const char *zero = memchr(s.text, '\0', (size_t)(s.end - s.text));
    if (zero != NULL)
        FAIL(error, LAM_ERR_FORMAT, "%s: line %zu holds a zero byte; not a text file", name,
             luminaire_source_place(&s, zero, NULL));
    for (const char *c = s.text; (c = memchr(c, '\n', (size_t)(s.end - c))) != NULL; c++) {
        ends++;
        doubled += c - s.text >= 2 && c[-1] == '\r' && c[-2] == '\r';
    }
    s.doubled = ends > 0 && doubled == ends;
    *out = s;
done:
    return status;
}

bool luminaire_source_line(const luminaire_source *s, const char **at, const char **begin, const char **end) {
    const char *c = *at;
    if (c >= s->end) return false;
    *begin = c;
    while (c < s->end && *c != '\r' && *c != '\n') c++;
    *end = c;
    if (s->doubled && s->end - c >= 3 && memcmp(c, "\r\r\n", 3) == 0)
        c += 3;
    else if (s->end - c >= 2 && memcmp(c, "\r\n", 2) == 0)
        c += 2;
    else if (c < s->end)
        c++;
    *at = c;
    return true;
}

size_t luminaire_source_place(const luminaire_source *s, const char *at, size_t *column) {
    size_t number = 0;
    const char *next = s->text, *begin = s->text, *end;
    while (next <= at && luminaire_source_line(s, &next, &begin, &end)) number++;
    if (column != NULL) *column = (size_t)(at - begin) + 1;
    return number > 0 ? number : 1;
}

bool luminaire_source_word(const luminaire_source *s, const char **at, const char **begin, const char **end) {
    const char *c = *at;
    while (c < s->end && (is_blank(*c) || *c == ',')) c++;
    *begin = c;
    while (c < s->end && !is_blank(*c) && *c != ',') c++;
    *at = *end = c;
    return c > *begin;
}

void luminaire_trim(const char **begin, const char **end) {
    while (*begin < *end && is_blank(**begin)) ++*begin;
    while (*end > *begin && is_blank((*end)[-1])) --*end;
}

void luminaire_clean(const char *begin, const char *end, char *out, size_t room) {
    size_t n = 0;
    luminaire_trim(&begin, &end);
    const bool latin1 = !utf8_is_valid(begin, (size_t)(end - begin));
    while (begin < end) {
        char pair[2];
        const char *from = begin;
        size_t length = latin1 ? utf8_of_latin1(begin, 1, pair) : utf8_sequence(begin, end);
        begin += latin1 ? 1 : length;
        if (latin1) from = pair;
        if (utf8_is_unfit(from, length)) {
            from = *from == '\t' ? " " : "?";
            length = 1;
        }
        if (n + length >= room) break;
        memcpy(out + n, from, length);
        n += length;
    }
    out[n] = '\0';
}

/* Numbers of up to 15 digits without an exponent, as nearly all are: the quotient of two integers that
 * doubles hold is rounded once, as strtod rounds, and takes a fifth of its time. */
static bool plain_number(const char *begin, const char *end, bool comma, double *out) {
    static const double powers[] = {1e0, 1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                    1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
    const bool negative = begin < end && *begin == '-';
    uint64_t mantissa = 0;
    size_t digits = 0, behind = 0;
    bool pointed = false;
    for (const char *c = begin + (begin < end && (*begin == '-' || *begin == '+')); c < end; c++) {
        if (*c >= '0' && *c <= '9') {
            mantissa = 10 * mantissa + (uint64_t)(*c - '0');
            behind += pointed;
            if (++digits > 15) return false;
        } else if (!pointed && (*c == '.' || (*c == ',' && comma))) {
            pointed = true;
        } else {
            return false;
        }
    }
    if (digits == 0) return false;
    *out = (negative ? -1. : 1.) * ((double)mantissa / powers[behind]);
    return true;
}

bool luminaire_number(const char *begin, const char *end, bool comma, double *out) {
    char word[64], *rest = NULL;
    size_t n = 0;
    if (plain_number(begin, end, comma, out)) return true;
    if (end - begin >= (ptrdiff_t)sizeof word) return false;
    for (; begin < end; begin++) {
        char c = *begin;
        if (c == ',' && comma) c = '.';
        if (c == 'd' || c == 'D') c = 'e';
        /* strtod reads "inf", "nan" and hexadecimal too. */
        if ((c < '0' || c > '9') && strchr("+-.eE", c) == NULL) return false;
        word[n++] = c;
    }
    word[n] = '\0';
    const double value = strtod(word, &rest);
    if (n == 0 || *rest != '\0' || !isfinite(value)) return false;
    *out = value;
    return true;
}

bool luminaire_in_limits(double value, double least, double most, bool above, char limit[LUMINAIRE_LIMIT]) {
    const bool low = !(value >= least) || (above && value == least);
    if (!low && value <= most) return true;
    if (low && least == 0 && !above)
        snprintf(limit, LUMINAIRE_LIMIT, "must not be negative");
    else
        snprintf(limit, LUMINAIRE_LIMIT, "must be %s %.10g",
                 !low    ? "at most"
                 : above ? "above"
                         : "at least",
                 low ? least : most);
    return false;
}

static void add_warning(luminaire_warnings *w, const char *format, va_list arguments) {
    char line[512];
    const size_t used = strlen(w->text);
    const int n = vsnprintf(line, sizeof line, format, arguments);
    if (n < 0 || used + strlen(line) + 2 > sizeof w->text) {
        w->omitted++;
        return;
    }
    snprintf(w->text + used, sizeof w->text - used, "%s%s", used > 0 ? "\n" : "", line);
}

void luminaire_warnings_add(luminaire_warnings *w, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    add_warning(w, format, arguments);
    va_end(arguments);
}

void luminaire_warn(luminaire *l, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    add_warning(&l->warnings, format, arguments);
    va_end(arguments);
}

lam_status luminaire_add_word(luminaire *l, size_t *capacity, const char *key, const char *begin,
                              const char *end, lam_error *error) {
    lam_status status = LAM_OK;
    luminaire_trim(&begin, &end);
    if (l->n_words >= LUMINAIRE_WORDS_MOST) goto done;
    TRY(array_grow(&l->words, capacity, l->n_words + 1, sizeof *l->words, "words of a luminaire", error));
    luminaire_word *word = &l->words[l->n_words++];
    snprintf(word->key, sizeof word->key, "%s", key);
    luminaire_clean(begin, end, word->text, sizeof word->text);
done:
    return status;
}

lam_status luminaire_allocate_table(luminaire *l, const char *name, size_t n_planes, size_t n_angles,
                                    lam_error *error) {
    size_t count = 0;
    if (!size_multiply(n_planes + 1, n_angles, &count))
        return status_fail(error, LAM_ERR_MEMORY, "%s: %zu by %zu values are too many", name, n_planes,
                           n_angles);
    l->planes = memory_allocate(n_planes + 1, sizeof *l->planes, name, error);
    l->angles = memory_allocate(n_angles, sizeof *l->angles, name, error);
    l->candela = memory_allocate(count, sizeof *l->candela, name, error);
    if (l->planes == NULL || l->angles == NULL || l->candela == NULL) return LAM_ERR_MEMORY;
    l->n_planes = n_planes;
    l->n_angles = n_angles;
    return LAM_OK;
}

void luminaire_close_turn(luminaire *l) {
    l->planes[l->n_planes] = l->planes[0] + 360;
    memcpy(l->candela + l->n_planes * l->n_angles, l->candela, l->n_angles * sizeof *l->candela);
    l->n_planes++;
}

/* Says what of a table that was read may surprise. */
static void warn_of_table(luminaire *l) {
    const double first = l->angles[0], last = l->angles[l->n_angles - 1], lumens = luminaire_lumens(l);
    if (l->type == LUMINAIRE_C && last != 90 && last != 180)
        luminaire_warn(l, "the table ends at %.10g degrees; light beyond it is 0", last);
    if (l->type == LUMINAIRE_C && first != 0 && first != 90)
        luminaire_warn(l, "the table begins at %.10g degrees; light before it is 0", first);
    if (!(lumens > 0)) luminaire_warn(l, "all candela are 0: the luminaire is dark");
    const double lamps = l->sets[l->set].lumens, *o = l->opening.size;
    const bool lossy = isnan(l->output_ratio) || l->output_ratio <= 0;
    if (lamps > 0 && lossy && lumens > 1.05 * lamps)
        luminaire_warn(l, "its candela add up to %.5g lm, but its lamps give %.5g lm", lumens, lamps);
    if (lamps > 0 && !lossy && fabs(lumens - lamps * l->output_ratio) > .05 * lamps * l->output_ratio)
        luminaire_warn(
            l,
            "its candela add up to %.5g lm, but its lamps (%.5g lm) and output ratio (%.5g %%) say %.5g lm",
            lumens, lamps, 100 * l->output_ratio, lamps * l->output_ratio);
    if (fmax(fmax(o[0], o[1]), o[2]) > 20)
        luminaire_warn(l, "its opening is %.4g x %.4g x %.4g m; is its unit right?", o[0], o[1], o[2]);
}

bool luminaire_is_named(const char *name, const char *extension) {
    const size_t length = strlen(name), tail = strlen(extension);
    return length >= tail && strcasecmp(name + length - tail, extension) == 0;
}

lam_status luminaire_read_text(const char *name, const char *text, size_t length,
                               const luminaire_options *options, luminaire *out, lam_error *error) {
    lam_status status = LAM_OK;
    luminaire_source s;
    luminaire l = {.measured_tilt = NAN, .output_ratio = NAN};
    TRY(luminaire_source_open(name, text, length, &s, error));
    const bool is_lm63 = lm63_is_it(&s);
    if (!is_lm63 && (eulumdat_is_it(&s) || luminaire_is_named(name, ".ldt"))) {
        TRY(eulumdat_read(&s, options, &l, error));
    } else if (is_lm63 || luminaire_is_named(name, ".ies")) {
        TRY(lm63_read(&s, options, &l, error));
    } else {
        FAIL(error, LAM_ERR_FORMAT,
             "%s: neither IES LM-63, which has a line TILT=, nor EULUMDAT, whose lines 2 to 4 are whole "
             "numbers",
             name);
    }
    warn_of_table(&l);
    if (!luminaire_is_sound(&l)) FAIL(error, LAM_ERR_INTERNAL, "%s: its table is not sound", name);
    *out = l;
    l = (luminaire){0};
done:
    luminaire_free(&l);
    return status;
}
