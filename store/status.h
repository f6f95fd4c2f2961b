/* The error idiom of the whole project (TRY, FAIL) and checked sizes. The lowest layer: knows nobody. */
#ifndef LAMBERT_STORE_STATUS_H
#define LAMBERT_STORE_STATUS_H

#include "lambert/lambert.h"

#include <stdbool.h>
#include <stddef.h>

/* In a function with `lam_status status` and a label `done`: leave by it unless the call returned LAM_OK. */
#define TRY(call)                                                                                            \
    do {                                                                                                     \
        status = (call);                                                                                     \
        if (status != LAM_OK) goto done;                                                                     \
    } while (0)

/* Leaves by `done` with this status and a printf-like message. */
#define FAIL(error, code, ...)                                                                               \
    do {                                                                                                     \
        status = status_fail((error), (code), __VA_ARGS__);                                                  \
        goto done;                                                                                           \
    } while (0)

/* Writes the message (cut to fit, one line: control characters become '?') and returns code.
 * error may be NULL. */
lam_status status_fail(lam_error *error, lam_status code, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* *product = a * b (or a * b * c * d); false when that passes SIZE_MAX, *product is then untouched. */
bool size_multiply(size_t a, size_t b, size_t *product);

/* As calloc for count * size bytes with the product checked; fills error with what and how much was wanted.
 * A count of 0 gives one byte, so that NULL always means failure. The caller frees with free().
 * In a file of its own (memory.c): a test that links its own memory_allocate can make it fail. */
void *memory_allocate(size_t count, size_t size, const char *what, lam_error *error);

#endif
