/* What is wrong with a request: an HTTP status with its application/problem+json (RFC 7807). */
#ifndef LAMBERT_CODEC_PROBLEM_H
#define LAMBERT_CODEC_PROBLEM_H

#include "solver/codec/buffer.h"

typedef struct problem {
    unsigned status; /* 0: nothing is wrong */
    char detail[480];
    char pointer[256]; /* JSON pointer to the member at fault, or "" */
} problem;

/* Fills p and returns false, so that a function can leave with it. */
bool problem_set(problem *p, unsigned status, const char *format, ...) __attribute__((format(printf, 3, 4)));

/* The registered phrase of a status. */
const char *problem_title(unsigned status);

/* Appends the JSON object and a newline; false when memory is short. */
bool problem_write(const problem *p, buffer *b);

#endif
