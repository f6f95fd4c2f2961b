/* Sparse rows for products of many short rows (the sliced ELLPACK format): sixteen rows of one length are a
 * slice, stored entry by entry, so that a vector register holds one entry of each row. */
#ifndef LAMBERT_LINALG_SLICED_H
#define LAMBERT_LINALG_SLICED_H

#include "solver/linalg/csr.h"

enum { SLICE_ROWS = 16 };

/* Values of slice_of for an empty row, and the bit that marks the number of a long row. */
#define SLICE_NONE UINT32_MAX
#define SLICE_LONG 0x80000000u

typedef struct slice {
    uint64_t begin; /* its first entry; entry e of lane l is at begin + e SLICE_ROWS + l */
    uint32_t length;
    uint32_t row[SLICE_ROWS]; /* a slice with fewer rows repeats its last one */
} slice;

typedef struct sliced_rows {
    const csr *all; /* must outlive the slices */
    size_t n_slices, n_long, n_empty;
    slice *slices;
    uint32_t *slice_of; /* [n], of a row */
    uint32_t *long_rows, *empty_rows;
    uint64_t *long_begin; /* [n_long], first entries, in halves or in all */
    float scale;          /* of a product */
    /* Indices and values of 16 bits, long rows behind the slices; NULL: 32 bits in indices and data, which
     * hold the slices alone. */
    uint16_t *half_indices, *halves;
    uint32_t *indices;
    float *data;
} sliced_rows;

/* Indices and values take 16 bits when a has at most 65,536 rows and each value is scale, a power of two,
 * times an f16; products have the same bits in both forms. scale 0: 32 bits. The caller frees with
 * sliced_free. Errors: LAM_ERR_MEMORY. */
lam_status sliced_create(const csr *a, float scale, sliced_rows *out, lam_error *error);
void sliced_free(sliced_rows *s);

/* Floats of work for m vectors, at most 16. */
size_t sliced_work(size_t n, size_t m);

/* Y_v = A X_v, X_v = X + v n, Y_v = Y + v n. Every sum has one order, so that the bits of a vector
 * depend on neither m nor n_threads. work is aligned to a cache line. */
void sliced_multiply(const sliced_rows *s, size_t m, const float *X, float *Y, float *work, size_t n_threads);

/* Bytes that a product reads. */
size_t sliced_bytes(const sliced_rows *s);

/* y_i = (A x)_i for `count` rows i, with the bits of sliced_multiply; other entries of y may change. */
void sliced_multiply_rows(const sliced_rows *s, size_t count, const uint32_t *rows, const float *x, float *y);

#endif
