/* Numbers and texts as JSON. Knows nothing of what they mean. No I/O. */
#ifndef LAMBERT_CODEC_JSON_WRITER_H
#define LAMBERT_CODEC_JSON_WRITER_H

#include "solver/codec/buffer.h"

#include <stdint.h>

/* The longest text of one float, and a buffer for it. */
#define JSON_FLOAT_MAX 16
#define JSON_FLOAT_ROOM 32

/* Writes each number with a comma behind it, in the shortest decimal that reads back as the same float, also
 * through a double, and of several the nearest; null for a value that is not finite. Returns the end. No NUL
 * is written; `to` has room for JSON_FLOAT_MAX + 1 bytes a number, and JSON_FLOAT_ROOM for the last. */
char *json_write_numbers(char *to, const float *values, size_t count);

/* Appends [v0,v1,...], null for a value that is not finite; false when memory is short. */
bool json_write_floats(buffer *b, const float *values, size_t count);

/* Appends the shortest decimal that reads back as the same double; null for a value that is not finite. */
bool json_write_double(buffer *b, double value);

/* Appends [v0,v1,...] of them; false when memory is short. */
bool json_write_doubles(buffer *b, const double *values, size_t count);

/* Appends a text in quotes, escaped; bytes that are not UTF-8 become '?'. */
bool json_write_text(buffer *b, const char *text);

#endif
