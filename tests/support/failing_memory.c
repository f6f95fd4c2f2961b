#include "support/failing_memory.h"

#include "store/status.h"

#include <stdint.h>
#include <stdlib.h>

long allocations_left = -1;

void *memory_allocate(size_t count, size_t size, const char *what, lam_error *cause) {
    size_t bytes;
    if (!size_multiply(count, size, &bytes) || bytes > PTRDIFF_MAX || allocations_left == 0) {
        status_fail(cause, LAM_ERR_MEMORY, "%s: cannot allocate %zu x %zu bytes", what, count, size);
        return NULL;
    }
    if (allocations_left > 0) allocations_left--;
    return calloc(bytes + (bytes == 0), 1);
}
