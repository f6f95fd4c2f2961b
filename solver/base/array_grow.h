/* Arrays that grow by half, so that n appended items cost O(n). */
#ifndef LAMBERT_BASE_ARRAY_GROW_H
#define LAMBERT_BASE_ARRAY_GROW_H

#include "store/status.h"

/* *array, a pointer to items of size bytes or to NULL, gets room for count items; *capacity, in items, rises
 * with it. After success *array is not NULL. Both stay as they are on LAM_ERR_MEMORY. */
lam_status array_grow(void *array, size_t *capacity, size_t count, size_t size, const char *what,
                      lam_error *error);

/* The capacity that array_grow takes, for several arrays that share one. */
size_t array_capacity(size_t capacity, size_t count);

/* *array gets room for exactly count items, or one byte for none; it stays as it is on LAM_ERR_MEMORY. */
lam_status array_resize(void *array, size_t count, size_t size, const char *what, lam_error *error);

#endif
