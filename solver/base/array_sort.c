#include "solver/base/array_sort.h"

#include <omp.h>
#include <stdlib.h>
#include <string.h>

/* Fewer items are not worth a parallel region; parts at most. */
enum { COUNT_LEAST = 8192, PARTS_MOST = 16 };

typedef int comparison(const void *, const void *);

/* Merges two sorted ranges, one of which lies behind the other, into as much room elsewhere. */
static void merge(const char *from, size_t first, size_t second, size_t size, comparison *compare, char *to) {
    const char *a = from, *b = from + first * size;
    const char *const a_end = b, *const b_end = b + second * size;
    while (a < a_end && b < b_end) {
        const char **less = compare(b, a) < 0 ? &b : &a;
        memcpy(to, *less, size);
        to += size;
        *less += size;
    }
    memcpy(to, a, (size_t)(a_end - a));
    memcpy(to + (a_end - a), b, (size_t)(b_end - b));
}

static size_t part_begin(size_t count, size_t part, size_t n_parts) {
    return count / n_parts * part + (part < count % n_parts ? part : count % n_parts);
}

void array_sort(void *array, size_t count, size_t size, int (*compare)(const void *, const void *)) {
    const size_t n_threads = omp_in_parallel() ? 1 : (size_t)omp_get_max_threads();
    size_t n_parts = 1;
    while (2 * n_parts <= n_threads && 2 * n_parts <= PARTS_MOST) n_parts *= 2;
    char *from = array, *to = n_parts > 1 && count >= COUNT_LEAST ? malloc(count * size) : NULL;
    char *const copy = to;
    if (copy == NULL) {
        if (count > 1) qsort(array, count, size, compare);
        return;
    }
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t k = 0; k < n_parts; k++) {
        const size_t first = part_begin(count, k, n_parts), last = part_begin(count, k + 1, n_parts);
        qsort(from + first * size, last - first, size, compare);
    }
    for (size_t wide = 1; wide < n_parts; wide *= 2) {
#pragma omp parallel for schedule(dynamic, 1)
        for (size_t k = 0; k < n_parts; k += 2 * wide) {
            const size_t first = part_begin(count, k, n_parts), middle = part_begin(count, k + wide, n_parts),
                         last = part_begin(count, k + 2 * wide, n_parts);
            merge(from + first * size, middle - first, last - middle, size, compare, to + first * size);
        }
        char *const swapped = from;
        from = to;
        to = swapped;
    }
    if (from != array) memcpy(array, from, count * size);
    free(copy);
}
