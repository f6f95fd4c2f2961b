#include "support/failing_memory.h"

#include "store/status.h"

#include <stdint.h>
#include <stdlib.h>

#ifdef LAMBERT_SANITIZED
#include <sanitizer/asan_interface.h>

/* A store is opened in a child process first. AddressSanitizer keeps up to 256 MB of freed memory, which
 * every fork copies the page tables of; 4 MB are a hundred times what such a test has at once. */
const char *__asan_default_options(void) {
    return "quarantine_size_mb=4";
}
#endif

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
