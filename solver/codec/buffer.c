#include "solver/codec/buffer.h"

#include "store/status.h"

#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool buffer_reserve(buffer *b, size_t more) {
    if (more >= SIZE_MAX / 4 || b->length >= SIZE_MAX / 4) return false;
    size_t needed = b->length + more + 1;
    if (needed > b->capacity) {
        size_t capacity = b->capacity < 256 ? 256 : b->capacity + b->capacity / 2;
        if (capacity < needed) capacity = needed;
        char *bytes = realloc(b->bytes, capacity);
        if (bytes == NULL) return false;
        memory_large_pages(bytes, capacity);
        b->bytes = bytes;
        b->capacity = capacity;
    }
    b->bytes[b->length] = '\0';
    return true;
}

bool buffer_append(buffer *b, const void *bytes, size_t count) {
    if (!buffer_reserve(b, count)) return false;
    if (count > 0) memcpy(b->bytes + b->length, bytes, count);
    b->length += count;
    b->bytes[b->length] = '\0';
    return true;
}

bool buffer_append_text(buffer *b, const char *text) {
    return buffer_append(b, text, strlen(text));
}

bool buffer_printf(buffer *b, const char *format, ...) {
    va_list arguments, again;
    va_start(arguments, format);
    va_copy(again, arguments);
    int length = vsnprintf(NULL, 0, format, arguments);
    bool done = length >= 0 && buffer_reserve(b, (size_t)length);
    if (done) {
        vsnprintf(b->bytes + b->length, (size_t)length + 1, format, again);
        b->length += (size_t)length;
    }
    va_end(again);
    va_end(arguments);
    return done;
}

void buffer_trim(buffer *b) {
    if (b->bytes == NULL || b->capacity == b->length + 1) return;
    char *bytes = realloc(b->bytes, b->length + 1);
    if (bytes == NULL) return;
    b->bytes = bytes;
    b->capacity = b->length + 1;
}

void buffer_free(buffer *b) {
    free(b->bytes);
    *b = (buffer){0};
}
