#include "solver/codec/answer_stream.h"

#include "solver/codec/json_writer.h"
#include "solver/codec/npy.h"
#include "store/status.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Most bytes of a JSON answer beside its numbers, but for the names of groups that are reduced. */
#define AROUND ((size_t)4 << 10)

/* A value and the brackets and commas around it. */
#define VALUE_MOST (JSON_FLOAT_ROOM + 6)

struct answer_stream {
    answer_shape shape;
    media_accept as;
    buffer head, tail;
    float *x;
    size_t count; /* numbers in all */
    size_t head_sent, tail_sent;
    size_t next; /* of x */
    size_t k, c; /* its element and channel */
};

static size_t count_of(const answer_shape *shape) {
    size_t count;
    return size_multiply(shape->n_rhs, shape->n_channels, &count) &&
                   size_multiply(count, shape->n_values, &count)
               ? count
               : SIZE_MAX;
}

size_t answer_bytes_most(const answer_shape *shape, const media_accept *as) {
    const size_t each = as->type == MEDIA_NPY ? npy_size(as->npy) : JSON_FLOAT_MAX + 1;
    size_t bytes, rows, all;
    /* Arrays of this many numbers are written in pieces, which take room of their own before they are joined.
     */
    const size_t pieces =
        as->type == MEDIA_JSON && shape->n_values >= 4096 ? (72u << 10) + shape->n_values / 64 : 0;
    /* Brackets and commas of rows, and the number of limited elements of a vector. */
    const size_t of_vector = 4 * shape->n_channels + (as->type == MEDIA_JSON ? 21 : 0);
    if (!size_multiply(count_of(shape), each, &bytes) || !size_multiply(shape->n_rhs, of_vector, &rows) ||
        __builtin_add_overflow(bytes, rows, &all) || __builtin_add_overflow(all, AROUND + pieces, &all))
        return SIZE_MAX;
    return all;
}

answer_stream *answer_stream_create(const answer_shape *shape, const media_accept *as, buffer *head, float *x,
                                    buffer *tail) {
    answer_stream *s = calloc(1, sizeof *s);
    if (s == NULL) return NULL;
    s->shape = *shape;
    s->as = *as;
    s->head = *head;
    s->tail = *tail;
    s->x = x;
    s->count = count_of(shape);
    *head = *tail = (buffer){0};
    return s;
}

void answer_stream_free(answer_stream *s) {
    if (s == NULL) return;
    buffer_free(&s->head);
    buffer_free(&s->tail);
    free(s->x);
    free(s);
}

/* Copies what fits of b behind *sent. */
static size_t read_buffer(const buffer *b, size_t *sent, char *to, size_t room) {
    const size_t left = b->length - *sent, count = left < room ? left : room;
    if (count > 0) memcpy(to, b->bytes + *sent, count);
    *sent += count;
    return count;
}

static size_t read_npy(answer_stream *s, char *to, size_t room) {
    const size_t each = npy_size(s->as.npy), left = s->count - s->next;
    const size_t count = left < room / each ? left : room / each;
    const float *x = s->x + s->next;
    npy_convert(s->as.npy, x, count, to);
    s->next += count;
    return count * each;
}

/* A row [v0,v1,...] stands in brackets with the other channels of its vector, where there are several. */
static char *before_row(const answer_stream *s, char *at) {
    if (s->next > 0) *at++ = ',';
    if (s->c == 0 && s->shape.n_channels > 1) *at++ = '[';
    *at++ = '[';
    return at;
}

static char *behind_row(answer_stream *s, char *at) {
    *at++ = ']';
    s->k = 0;
    if (++s->c < s->shape.n_channels) return at;
    s->c = 0;
    if (s->shape.n_channels > 1) *at++ = ']';
    return at;
}

static size_t read_json(answer_stream *s, char *to, size_t room) {
    char *at = to, *const end = to + room;
    while (s->next < s->count && end - at >= VALUE_MOST) {
        const size_t in_room = (size_t)(end - at - VALUE_MOST) / (JSON_FLOAT_MAX + 1) + 1;
        const size_t in_row = s->shape.n_values - s->k;
        const size_t count = in_room < in_row ? in_room : in_row;
        if (s->k == 0)
            at = before_row(s, at);
        else
            *at++ = ',';
        at = json_write_numbers(at, s->x + s->next, count) - 1; /* without the last comma */
        s->next += count;
        s->k += count;
        if (s->k == s->shape.n_values) at = behind_row(s, at);
    }
    return (size_t)(at - to);
}

size_t answer_stream_read(answer_stream *s, char *to, size_t room) {
    size_t written = read_buffer(&s->head, &s->head_sent, to, room);
    if (room - written >= VALUE_MOST)
        written += s->as.type == MEDIA_NPY ? read_npy(s, to + written, room - written)
                                           : read_json(s, to + written, room - written);
    if (s->next == s->count) written += read_buffer(&s->tail, &s->tail_sent, to + written, room - written);
    return written;
}

size_t answer_stream_look(const answer_stream *s, char *to, size_t room) {
    answer_stream copy = *s;
    return answer_stream_read(&copy, to, room);
}

bool answer_check_encoding(const answer_shape *shape, const media_accept *as, const float *x, problem *why) {
    return answer_check_as(x, count_of(shape), shape->gaps, as, why);
}

uint64_t answer_stream_most(const answer_stream *s) {
    return answer_bytes_most(&s->shape, &s->as);
}

uint64_t answer_stream_length(const answer_stream *s) {
    if (s->as.type != MEDIA_NPY) return UINT64_MAX;
    return s->head.length + (uint64_t)s->count * npy_size(s->as.npy) + s->tail.length;
}

size_t answer_stream_held(const answer_stream *s) {
    return sizeof *s + s->head.capacity + s->tail.capacity + s->count * sizeof *s->x;
}
