/* The work area that a caller brings for a product or an answer: its size as a sum of aligned parts, and the
 * parts one after another. It knows nothing of what they hold. */
#ifndef LAMBERT_BASE_WORK_AREA_H
#define LAMBERT_BASE_WORK_AREA_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Alignment of every part, in bytes: a line of the cache and the widest register. */
#define WORK_AREA_ALIGN 64

/* *total += bytes rounded up to WORK_AREA_ALIGN; false on an overflow. */
static inline bool work_area_add(size_t *total, size_t bytes) {
    size_t rounded;
    return !__builtin_add_overflow(bytes, WORK_AREA_ALIGN - 1, &rounded) &&
           !__builtin_add_overflow(*total, rounded / WORK_AREA_ALIGN * WORK_AREA_ALIGN, total);
}

/* The first aligned address of a work area, at most WORK_AREA_ALIGN - 1 bytes from its begin. */
static inline void *work_area_begin(const void *work) {
    const uintptr_t begin = (uintptr_t)work;
    return (void *)((begin + WORK_AREA_ALIGN - 1) / WORK_AREA_ALIGN * WORK_AREA_ALIGN);
}

/* The next part of a work area that was measured with work_area_add. */
static inline void *work_area_take(void **work, size_t bytes) {
    char *part = *work;
    *work = part + (bytes + WORK_AREA_ALIGN - 1) / WORK_AREA_ALIGN * WORK_AREA_ALIGN;
    return part;
}

#endif
