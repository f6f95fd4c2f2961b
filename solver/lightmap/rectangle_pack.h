/* Rectangles side by side in one, on shelves (Coffman, Garey, Johnson and Tarjan 1980: next fit by falling
 * height). Knows no charts. */
#ifndef LAMBERT_LIGHTMAP_RECTANGLE_PACK_H
#define LAMBERT_LIGHTMAP_RECTANGLE_PACK_H

#include "store/status.h"

#include <stdint.h>

typedef struct packed_rectangle {
    size_t width, height; /* given */
    size_t x, y;          /* found: its first column and row */
} packed_rectangle;

/* Places n rectangles so that none overlap, in the smallest of some areas, no side of which exceeds most. A
 * result of 0 by 0: they do not fit. Cost: O(n log n). Errors: LAM_ERR_MEMORY. */
lam_status rectangles_pack(size_t n, packed_rectangle *rectangles, size_t most, size_t *width, size_t *height,
                           lam_error *error);

#endif
