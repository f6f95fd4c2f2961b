/* Sorts large arrays with all threads. */
#ifndef LAMBERT_BASE_ARRAY_SORT_H
#define LAMBERT_BASE_ARRAY_SORT_H

#include <stddef.h>

/* qsort by several threads: parts are sorted, then merged two by two. Items that compare equal keep no order,
 * as with qsort: a compare that tells all items apart has the same result for any number of threads. Within a
 * parallel region, or without memory for a copy, it is qsort. Cost: O(n log n). */
void array_sort(void *array, size_t count, size_t size, int (*compare)(const void *, const void *));

#endif
