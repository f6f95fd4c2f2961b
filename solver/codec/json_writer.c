#include "solver/codec/json_writer.h"

#include "solver/base/parallel.h"
#include "solver/base/utf8.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Pieces that are written at once; numbers of a long array, and of a piece, with the room that this takes at
 * most. */
enum {
    TOGETHER = 64,
    LONG = 32768,
    PIECE = 4096,
    PIECE_ROOM = PIECE * (JSON_FLOAT_MAX + 1) + JSON_FLOAT_ROOM
};

static bool reserve_floats(buffer *b, size_t count) {
    size_t bytes;
    return !__builtin_mul_overflow(count / PIECE + 1, (size_t)PIECE_ROOM, &bytes) &&
           bytes < SIZE_MAX - 2 - JSON_FLOAT_ROOM &&
           buffer_reserve(b, count < PIECE ? count * (JSON_FLOAT_MAX + 1) + 2 + JSON_FLOAT_ROOM : bytes + 2);
}

/* Pieces of an array, written apart. */
typedef struct pieces {
    const float *values;
    size_t count;
    char *to;       /* piece p at p PIECE_ROOM */
    size_t *length; /* of each piece */
} pieces;

static void write_pieces(const void *job, size_t thread, size_t first, size_t last) {
    const pieces *p = job;
    (void)thread;
    for (size_t k = first; k < last; k++) {
        char *const to = p->to + k * PIECE_ROOM;
        const size_t left = p->count - k * PIECE;
        p->length[k] =
            (size_t)(json_write_numbers(to, p->values + k * PIECE, left < PIECE ? left : PIECE) - to);
    }
}

/* The numbers of a long array by the threads that are free, then pushed together. */
static char *write_together(char *at, const float *values, size_t count) {
    size_t length[TOGETHER];
    for (size_t first = 0; first < count; first += (size_t)TOGETHER * PIECE) {
        const size_t left = count - first,
                     some = left < (size_t)TOGETHER * PIECE ? left : (size_t)TOGETHER * PIECE;
        const pieces p = {values + first, some, at, length};
        const size_t n_pieces = (some + PIECE - 1) / PIECE;
        parallel_share(parallel_threads(), n_pieces, 1, write_pieces, &p);
        for (size_t k = 0; k < n_pieces; k++) {
            if (k > 0) memmove(at, p.to + k * PIECE_ROOM, length[k]);
            at += length[k];
        }
    }
    return at;
}

bool json_write_floats(buffer *b, const float *values, size_t count) {
    if (!reserve_floats(b, count)) return false;
    char *at = b->bytes + b->length;
    *at++ = '[';
    at = count < LONG || parallel_threads() < 2 ? json_write_numbers(at, values, count)
                                                : write_together(at, values, count);
    if (count > 0) at--;
    *at++ = ']';
    *at = '\0';
    b->length = (size_t)(at - b->bytes);
    return true;
}

bool json_write_double(buffer *b, double value) {
    char text[32];
    if (!isfinite(value)) return buffer_append(b, "null", 4);
    /* A number of at most 15 digits survives the way through a double, so that 15 digits without trailing
     * zeros reproduce it; denormal numbers have fewer. */
    int precision = fabs(value) < 1e-290 ? 1 : 15;
    do snprintf(text, sizeof text, "%.*g", precision, value);
    while (precision++ < 17 && strtod(text, NULL) != value);
    return buffer_append_text(b, text);
}

bool json_write_doubles(buffer *b, const double *values, size_t count) {
    bool written = buffer_append(b, "[", 1);
    for (size_t i = 0; written && i < count; i++)
        written = (i == 0 || buffer_append(b, ",", 1)) && json_write_double(b, values[i]);
    return written && buffer_append(b, "]", 1);
}

bool json_write_text(buffer *b, const char *text) {
    const char *end = text + strlen(text);
    bool written = buffer_append(b, "\"", 1);
    while (written && text < end) {
        size_t length = utf8_sequence(text, end);
        unsigned char c = (unsigned char)*text;
        if (length == 0) {
            written = buffer_append(b, "?", 1);
            length = 1;
        } else if (c == '"' || c == '\\') {
            written = buffer_append(b, "\\", 1) && buffer_append(b, text, 1);
        } else if (c < 0x20) {
            written = buffer_printf(b, "\\u%04x", c);
        } else {
            written = buffer_append(b, text, length);
        }
        text += length;
    }
    return written && buffer_append(b, "\"", 1);
}
