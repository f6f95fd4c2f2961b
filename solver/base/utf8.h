/* UTF-8: which bytes are text, and texts of one byte a character made so. */
#ifndef LAMBERT_BASE_UTF8_H
#define LAMBERT_BASE_UTF8_H

#include <stdbool.h>
#include <stddef.h>

/* Bytes of the valid UTF-8 sequence that starts at `at`, 0 when there is none before `end`. */
size_t utf8_sequence(const char *at, const char *end);

/* True where all of the text's length bytes are valid UTF-8. */
bool utf8_is_valid(const char *text, size_t length);

/* Writes length bytes of Latin-1 (ISO 8859-1) as UTF-8 to out, which has room for 2 length bytes, without a
 * NUL; returns how many bytes were written. */
size_t utf8_of_latin1(const char *text, size_t length, char *out);

/* True for a character, of so many bytes, that a line for people may not have: a control, also of U+0080 to
 * U+009F, an end of a line or paragraph, a mark of the direction of writing. */
bool utf8_is_unfit(const char *at, size_t length);

#endif
