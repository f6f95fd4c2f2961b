/* Memory that fails when told to: for programs that see to it that no failed allocation is lost. */
#ifndef LAMBERT_TESTS_FAILING_MEMORY_H
#define LAMBERT_TESTS_FAILING_MEMORY_H

#include "store/status.h"

#include <stdint.h>
#include <stdlib.h>

static long allocations_left = -1; /* negative: no end */

/* Takes the place of the one in store/memory.c. */
void *memory_allocate(size_t count, size_t size, const char *what, lam_error *cause) {
    size_t bytes;
    if (!size_multiply(count, size, &bytes) || bytes > PTRDIFF_MAX || allocations_left == 0) {
        status_fail(cause, LAM_ERR_MEMORY, "%s: cannot allocate %zu x %zu bytes", what, count, size);
        return NULL;
    }
    if (allocations_left > 0) allocations_left--;
    return calloc(bytes + (bytes == 0), 1);
}

#endif
