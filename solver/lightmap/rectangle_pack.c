#include "solver/lightmap/rectangle_pack.h"

#include <math.h>
#include <stdlib.h>

/* Widths that are tried, from the root of all areas on. */
enum { TRIES = 16 };

typedef struct by_height {
    const packed_rectangle *of;
    size_t number;
} by_height;

/* Falling heights, then falling widths, then numbers. */
static int compare(const void *a, const void *b) {
    const by_height *first = a, *second = b;
    const packed_rectangle *p = first->of, *q = second->of;
    if (p->height != q->height) return p->height < q->height ? 1 : -1;
    if (p->width != q->width) return p->width < q->width ? 1 : -1;
    return first->number < second->number ? -1 : first->number > second->number;
}

/* The height of shelves of a width; places are set where `put` is. */
static size_t stack(const by_height *order, size_t n, size_t width, packed_rectangle *put) {
    size_t x = 0, y = 0, shelf = 0;
    for (size_t k = 0; k < n; k++) {
        const packed_rectangle *r = order[k].of;
        if (x + r->width > width) {
            y += shelf;
            x = shelf = 0;
        }
        if (shelf == 0) shelf = r->height;
        if (put != NULL) {
            put[order[k].number].x = x;
            put[order[k].number].y = y;
        }
        x += r->width;
    }
    return y + shelf;
}

lam_status rectangles_pack(size_t n, packed_rectangle *rectangles, size_t most, size_t *width, size_t *height,
                           lam_error *error) {
    double area = 0, best = INFINITY;
    size_t widest = 1;
    *width = *height = 0;
    by_height *order = memory_allocate(n, sizeof *order, "a lightmap", error);
    if (order == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < n; k++) {
        const packed_rectangle *r = &rectangles[k];
        order[k] = (by_height){r, k};
        area += (double)r->width * (double)r->height;
        if (r->width > widest) widest = r->width;
    }
    qsort(order, n, sizeof *order, compare);
    for (int t = 0; t < TRIES && sqrt(area) < (double)most; t++) {
        size_t w = (size_t)ceil(sqrt(area) * (1 + (double)t / TRIES));
        if (w < widest) w = widest;
        const size_t h = w <= most ? stack(order, n, w, NULL) : most + 1;
        if (h > most || (double)w * (double)h >= best) continue;
        best = (double)w * (double)h;
        *width = w;
        *height = h;
    }
    if (*width > 0) stack(order, n, *width, rectangles);
    free(order);
    return LAM_OK;
}
