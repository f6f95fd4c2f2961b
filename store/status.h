/* The error idiom of the whole project (TRY, FAIL) and checked sizes. The lowest layer: includes the public
 * header alone. */
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

/* *product = a * b; false, with *product untouched, if that exceeds SIZE_MAX. */
bool size_multiply(size_t a, size_t b, size_t *product);

/* As calloc for count * size bytes with the product checked; the error names `what` and the size. A count of
 * 0 gives one byte, so that NULL always means failure. The caller frees with free(). It stands in a file of
 * its own (memory.c), so that a test can link a memory_allocate that fails. */
void *memory_allocate(size_t count, size_t size, const char *what, lam_error *error);

/* Asks for large pages where memory that was not touched yet has some MB: the kernel then zeroes 2 MB in one
 * fault, where 512 faults take many times as long as what is written there. memory_allocate does so itself.
 */
void memory_large_pages(void *memory, size_t bytes);

#endif
