/* An answer of many numbers that is encoded while it is sent: it holds them as they were computed, 4 bytes
 * each, in place of their text, which takes 10 and more. No I/O. */
#ifndef LAMBERT_CODEC_ANSWER_STREAM_H
#define LAMBERT_CODEC_ANSWER_STREAM_H

#include "solver/codec/answer.h"

#include <stdint.h>

typedef struct answer_stream answer_stream;

/* Room that a read needs at least. */
#define ANSWER_STREAM_LEAST 64

/* Bytes of an answer, at most, and the longest that is worth to be encoded as a whole. */
size_t answer_bytes_most(const answer_shape *shape, const media_accept *as);
#define ANSWER_WHOLE ((size_t)12 << 20)

/* Takes over head, the bytes of answer_begin; x [n_rhs][C][n_values], which answer_check_encoding has passed;
 * and tail, those of answer_end. Errors: NULL when memory is short, everything is then the caller's. */
answer_stream *answer_stream_create(const answer_shape *shape, const media_accept *as, buffer *head, float *x,
                                    buffer *tail);
void answer_stream_free(answer_stream *s);

/* 422 if a value is beyond what the encoding holds. */
bool answer_check_encoding(const answer_shape *shape, const media_accept *as, const float *x, problem *why);

/* The bytes that come next, at most `room` (ANSWER_STREAM_LEAST or more); 0 at the end. O(room). */
size_t answer_stream_read(answer_stream *s, char *to, size_t room);

/* The first bytes, at most `room`, without a step forward. */
size_t answer_stream_look(const answer_stream *s, char *to, size_t room);

/* Bytes of the whole, at most. */
uint64_t answer_stream_most(const answer_stream *s);

/* The length of the whole in bytes; UINT64_MAX: it is not known before. */
uint64_t answer_stream_length(const answer_stream *s);

/* Bytes of memory that it holds. */
size_t answer_stream_held(const answer_stream *s);

#endif
