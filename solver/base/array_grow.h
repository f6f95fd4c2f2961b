/* Arrays that grow. */
#ifndef LAMBERT_BASE_ARRAY_GROW_H
#define LAMBERT_BASE_ARRAY_GROW_H

#include "store/status.h"

#include <stdlib.h>
#include <string.h>

/* Gives *array, whatever it points to, room for count values; it stays as it is on LAM_ERR_MEMORY. */
static inline lam_status grow(void *array, size_t count, size_t size, lam_error *error) {
    void *old, *made;
    memcpy(&old, array, sizeof old);
    made = realloc(old, count * size);
    if (made == NULL)
        return status_fail(error, LAM_ERR_MEMORY, "cannot allocate %zu x %zu bytes; use a smaller scene",
                           count, size);
    memcpy(array, &made, sizeof made);
    return LAM_OK;
}

#endif
