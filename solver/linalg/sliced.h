/* Sparse rows for products where rows are short and many: sixteen of one length side by side, an entry of
 * each at a time, so that no row begins or ends alone. */
#ifndef LAMBERT_LINALG_SLICED_H
#define LAMBERT_LINALG_SLICED_H

#include "solver/linalg/csr.h"

enum { SLICE_ROWS = 16 };

/* Instead of a slice: an empty row, or the number of a long one with this bit. */
#define SLICE_NONE UINT32_MAX
#define SLICE_LONG 0x80000000u

typedef struct slice {
    uint64_t begin; /* of its entries, SLICE_ROWS of them at a time */
    uint32_t length;
    uint32_t row[SLICE_ROWS]; /* where there are fewer the last one stands for the others too */
} slice;

typedef struct sliced_rows {
    const csr *all; /* which outlives it */
    size_t n_slices, n_long, n_empty;
    slice *slices;
    uint32_t *slice_of; /* [n], of a row */
    uint32_t *long_rows, *empty_rows;
    uint64_t *long_begin; /* [n_long], their entries: of halves, or else of all */
    float scale;          /* of a product */
    /* Entries in 16 bits each, those of long rows behind the others; NULL: in 32, where long rows are those
     * of all. */
    uint16_t *half_indices, *halves;
    uint32_t *indices;
    float *data;
} sliced_rows;

/* Where a has 65,536 rows at most, and scale is a power of two that its numbers are halves times of, 16 bits
 * are enough for an index and for a number, with the same bits in every product; scale 0: they are not. Freed
 * by sliced_free. Errors: LAM_ERR_MEMORY. */
lam_status sliced_create(const csr *a, float scale, sliced_rows *out, lam_error *error);
void sliced_free(sliced_rows *s);

/* Floats of work for m vectors, at most 16. */
size_t sliced_work(size_t n, size_t m);

/* Y_v = A X_v, X_v = X + v n, Y_v = Y + v n. Every sum is made in one order: a vector's bits depend on
 * neither m nor n_threads. work is aligned to a cache line. */
void sliced_multiply(const sliced_rows *s, size_t m, const float *X, float *Y, float *work, size_t n_threads);

/* Bytes that a product reads. */
size_t sliced_bytes(const sliced_rows *s);

/* The same numbers of one vector for `count` rows, and some others; what the rest of y holds is not said. */
void sliced_multiply_rows(const sliced_rows *s, size_t count, const uint32_t *rows, const float *x, float *y);

#endif
