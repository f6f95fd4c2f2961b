/* Sparse rows for products where rows are short and many: sixteen of one length side by side, an entry of
 * each at a time, so that no row begins or ends alone. */
#ifndef LAMBERT_OPERATOR_SLICED_H
#define LAMBERT_OPERATOR_SLICED_H

#include "solver/operator/csr.h"

enum { SLICE_ROWS = 16 };

#define SLICE_NONE UINT32_MAX

typedef struct slice {
    uint64_t begin; /* of its entries, SLICE_ROWS of them at a time */
    uint32_t length;
    uint32_t row[SLICE_ROWS]; /* where there are fewer the last one stands for the others too */
} slice;

typedef struct sliced_rows {
    const csr *all; /* which outlives it: rows that are too long for slices are multiplied there */
    size_t n_slices, n_long, n_empty;
    slice *slices;
    uint32_t *slice_of; /* [n], of a row; SLICE_NONE: it is long or empty */
    uint32_t *long_rows, *empty_rows;
    uint32_t *indices;
    float *data;
} sliced_rows;

/* Freed by sliced_free. Errors: LAM_ERR_MEMORY. */
lam_status sliced_create(const csr *a, sliced_rows *out, lam_error *error);
void sliced_free(sliced_rows *s);

/* Floats of work for m vectors, at most 16. */
size_t sliced_work(size_t n, size_t m);

/* Y_v = A X_v, X_v = X + v n, Y_v = Y + v n. Every sum is made in one order: a vector's bits depend on
 * neither m nor n_threads. work is aligned to a cache line. */
void sliced_multiply(const sliced_rows *s, size_t m, const float *X, float *Y, float *work, size_t n_threads);

/* The same numbers of one vector for `count` rows, and some others; what the rest of y holds is not said. */
void sliced_multiply_rows(const sliced_rows *s, size_t count, const uint32_t *rows, const float *x, float *y);

#endif
