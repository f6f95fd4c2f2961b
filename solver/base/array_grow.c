#include "solver/base/array_grow.h"

#include <stdlib.h>
#include <string.h>

enum { LEAST = 64 };

size_t array_capacity(size_t capacity, size_t count) {
    if (count <= capacity) return capacity;
    const size_t more = capacity + capacity / 2 < LEAST ? LEAST : capacity + capacity / 2;
    return more < count ? count : more;
}

lam_status array_resize(void *array, size_t count, size_t size, const char *what, lam_error *error) {
    size_t bytes;
    void *old, *made = NULL;
    memcpy(&old, array, sizeof old);
    if (size_multiply(count, size, &bytes)) made = realloc(old, bytes > 0 ? bytes : 1);
    if (made == NULL)
        return status_fail(error, LAM_ERR_MEMORY, "%s: cannot allocate %zu x %zu bytes; use a smaller scene",
                           what, count, size);
    memory_large_pages(made, bytes);
    memcpy(array, &made, sizeof made);
    return LAM_OK;
}

lam_status array_grow(void *array, size_t *capacity, size_t count, size_t size, const char *what,
                      lam_error *error) {
    void *old;
    memcpy(&old, array, sizeof old);
    if (count <= *capacity && old != NULL) return LAM_OK;
    const size_t more = array_capacity(*capacity, count > 0 ? count : 1);
    const lam_status status = array_resize(array, more, size, what, error);
    if (status == LAM_OK) *capacity = more;
    return status;
}
