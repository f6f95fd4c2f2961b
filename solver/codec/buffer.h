/* Bytes that grow: request bodies and answers. */
#ifndef LAMBERT_CODEC_BUFFER_H
#define LAMBERT_CODEC_BUFFER_H

#include <stdbool.h>
#include <stddef.h>

/* Starts zeroed; bytes[length] is NUL once anything was reserved. */
typedef struct buffer {
    char *bytes;
    size_t length;
    size_t capacity;
} buffer;

/* Makes room for `more` bytes and a NUL behind them; false when memory is short, b is then as before. */
bool buffer_reserve(buffer *b, size_t more);

bool buffer_append(buffer *b, const void *bytes, size_t count);
bool buffer_append_text(buffer *b, const char *text);
bool buffer_printf(buffer *b, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Gives back what was reserved and not used, as far as the allocator can. */
void buffer_trim(buffer *b);

void buffer_free(buffer *b);

#endif
