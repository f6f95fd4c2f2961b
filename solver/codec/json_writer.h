/* Numbers and texts as JSON. Knows nothing of what they mean. No I/O. */
#ifndef LAMBERT_CODEC_JSON_WRITER_H
#define LAMBERT_CODEC_JSON_WRITER_H

#include "solver/codec/buffer.h"

#include <stdint.h>

/* The longest text of one float, and a buffer for it. */
#define JSON_FLOAT_MAX 16
#define JSON_FLOAT_ROOM 32

/* Writes the shortest decimal that reads back as the same float (in a few cases per thousand a longer one,
 * never of more than 9 digits), or null for a value that is not finite, and returns how many characters. No
 * NUL is written; to has room for the longest. */
size_t json_write_float(char *to, float value);

/* Appends [v0,v1,...], null for a value that is not finite; false when memory is short. */
bool json_write_floats(buffer *b, const float *values, size_t count);

/* Appends the shortest decimal that reads back as the same double; null for a value that is not finite. */
bool json_write_double(buffer *b, double value);

/* Appends [v0,v1,...] of them; false when memory is short. */
bool json_write_doubles(buffer *b, const double *values, size_t count);

/* Appends a text in quotes, escaped; bytes that are not UTF-8 become '?'. */
bool json_write_text(buffer *b, const char *text);

#endif
