#include "solver/scene/mesh.h"

#include "solver/base/array_sort.h"

#include <math.h>
#include <stdlib.h>

/* Bits per axis: three axes fill 63 bits of a key. */
#define Z_ORDER_BITS 21

/* Spreads the low 21 bits of x so that two zero bits follow each. */
static uint64_t spread(uint64_t x) {
    x = (x | x << 32) & UINT64_C(0x001f00000000ffff);
    x = (x | x << 16) & UINT64_C(0x001f0000ff0000ff);
    x = (x | x << 8) & UINT64_C(0x100f00f00f00f00f);
    x = (x | x << 4) & UINT64_C(0x10c30c30c30c30c3);
    x = (x | x << 2) & UINT64_C(0x1249249249249249);
    return x;
}

typedef struct keyed {
    uint64_t key;
    uint32_t element;
} keyed;

static int by_key(const void *a, const void *b) {
    const keyed *x = a, *y = b;
    if (x->key != y->key) return x->key < y->key ? -1 : 1;
    return (x->element > y->element) - (x->element < y->element); /* equal keys stay in mesh order */
}

lam_status mesh_z_order(const mesh *m, uint32_t *order, lam_error *error) {
    double low[3] = {0, 0, 0}, high[3] = {0, 0, 0}, extent = 0;
    keyed *keys = memory_allocate(m->n, sizeof *keys, "Z-order", error);
    if (keys == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < m->n; i++) {
        double c[3];
        mesh_centroid(m, i, c);
        for (int k = 0; k < 3; k++) {
            if (i == 0 || c[k] < low[k]) low[k] = c[k];
            if (i == 0 || c[k] > high[k]) high[k] = c[k];
        }
    }
    /* One scale for the three axes: cells are cubes, so that neighbours in the order are near in space. */
    for (int k = 0; k < 3; k++) extent = fmax(extent, high[k] - low[k]);
    const double cells = (double)((1u << Z_ORDER_BITS) - 1), scale = extent > 0 ? cells / extent : 0;
    for (size_t i = 0; i < m->n; i++) {
        double c[3];
        uint64_t key = 0;
        mesh_centroid(m, i, c);
        for (int k = 0; k < 3; k++) {
            const double cell = fmin(fmax((c[k] - low[k]) * scale, 0), cells);
            key |= spread((uint64_t)cell) << k;
        }
        keys[i] = (keyed){key, (uint32_t)i};
    }
    array_sort(keys, m->n, sizeof *keys, by_key);
    for (size_t i = 0; i < m->n; i++) order[i] = keys[i].element;
    free(keys);
    return LAM_OK;
}
