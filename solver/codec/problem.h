/* A refused request: the class of the problem, which has an HTTP status, a title and a section of the manual,
 * and what is wrong this time. Written as application/problem+json (RFC 9457). */
#ifndef LAMBERT_CODEC_PROBLEM_H
#define LAMBERT_CODEC_PROBLEM_H

#include "solver/codec/buffer.h"

/* The classes; problem.c has a row for each. */
typedef enum problem_kind {
    PROBLEM_NONE,
    PROBLEM_MALFORMED_HEAD,
    PROBLEM_NOT_JSON,
    PROBLEM_NOT_NPY,
    PROBLEM_NO_TOKEN,
    PROBLEM_NO_RIGHT,
    PROBLEM_NOT_ALLOWED,
    PROBLEM_WRONG_HOST,
    PROBLEM_WRONG_ORIGIN,
    PROBLEM_NOT_FOUND,
    PROBLEM_WRONG_METHOD,
    PROBLEM_CONFLICT,
    PROBLEM_TOO_LONG,
    PROBLEM_MEDIA_TYPE,
    PROBLEM_WRONG_KIND,
    PROBLEM_WRONG_MEMBERS,
    PROBLEM_WRONG_LENGTH,
    PROBLEM_BAD_INDEX,
    PROBLEM_BAD_VALUE,
    PROBLEM_UNKNOWN_GROUP,
    PROBLEM_UNKNOWN_WORD,
    PROBLEM_GIVEN_TWICE,
    PROBLEM_TOO_MUCH,
    PROBLEM_NOT_IN_STORE,
    PROBLEM_NOT_IN_ENCODING,
    PROBLEM_NOT_REFINED,
    PROBLEM_TOO_MANY_VARIANTS,
    PROBLEM_INTERNAL,
    PROBLEM_TRANSFER_CODING,
    PROBLEM_NO_MEMORY,
    PROBLEM_UNAVAILABLE,
    PROBLEM_COUNT
} problem_kind;

typedef struct problem {
    unsigned status; /* 0: nothing is wrong */
    problem_kind kind;
    char detail[480];
    char pointer[256]; /* JSON pointer to the member at fault, or "" */
} problem;

/* Fills p and returns false, so that a function can leave with it. */
bool problem_set(problem *p, problem_kind kind, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* The HTTP status of a class, its title, and the section of the manual that explains it: a path in the source
 * and in an installation's documents, with an anchor. */
unsigned problem_status(problem_kind kind);
const char *problem_title(problem_kind kind);
const char *problem_type(problem_kind kind);

/* Appends the JSON object and a newline; false when memory is short. */
bool problem_write(const problem *p, buffer *b);

#endif
