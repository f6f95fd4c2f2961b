/* memory_allocate in a file of its own: a test may link one that fails on demand in its place. */
#include "store/status.h"

#include <stdint.h>
#include <stdlib.h>

void *memory_allocate(size_t count, size_t size, const char *what, lam_error *error) {
    size_t bytes;
    void *memory = NULL;
    if (size_multiply(count, size, &bytes) && bytes <= PTRDIFF_MAX) {
        memory = calloc(bytes == 0 ? 1 : bytes, 1);
        memory_large_pages(memory, bytes);
    }
    if (memory == NULL)
        status_fail(error, LAM_ERR_MEMORY, "%s: cannot allocate %zu x %zu bytes; use a smaller scene", what,
                    count, size);
    return memory;
}
