/* The interface through which methods read rows of F, which lie in memory or in a file or are sampled by
 * rays. It counts passes over F and knows no method. */
#ifndef LAMBERT_LINALG_ROW_SOURCE_H
#define LAMBERT_LINALG_ROW_SOURCE_H

#include "solver/linalg/csr.h"

/* Rows of m elements: row k has length[k] entries, indices[k] ascending and data[k]. row_block_free frees the
 * arrays in owned. */
typedef struct row_block {
    size_t m;
    const uint32_t *const *indices; /* [m] */
    const float *const *data;       /* [m] */
    size_t *length;                 /* [m] */
    void *owned[5];
} row_block;

void row_block_free(row_block *block);

typedef struct row_source {
    size_t n;
    double density; /* approximate share of the n^2 entries that are stored */
    /* The rows of elements[0] ... elements[m-1]. Any number of threads may call it at once. */
    lam_status (*rows)(void *context, const uint32_t *elements, size_t m, row_block *out, lam_error *error);
    void *context;
    uint64_t rows_given; /* counted by row_source_get */
} row_source;

/* Rows of F, which must outlive the source, from memory: nothing is copied. */
void row_source_of_csr(row_source *source, const csr *F);

/* The rows of elements[0] ... elements[m-1], freed by row_block_free. Errors: LAM_ERR_MEMORY, those of the
 * source. */
lam_status row_source_get(row_source *source, const uint32_t *elements, size_t m, row_block *out,
                          lam_error *error);

/* Rows read so far over n. */
double row_source_passes(const row_source *source);

/* Rows of F that are sampled when they are read and not kept. */
typedef struct row_stream {
    row_source rows; /* of F1, A F = A F1 + F1^T A; each row is read once; its entries stand in any order, and
                        an index may repeat */
    /* Called once, after all rows: the row sums [n] of F, scaled so that closed scenes sum to 1. They live as
     * long as the stream. */
    lam_status (*close)(void *context, const double **row_sums, lam_error *error);
    void *context;        /* of close */
    double noise_share;   /* of the rows of S by a sample: their noise over that of a closed scene of equal
                             elements, above 0; 0: not known */
    const uint32_t *part; /* [n]: parts of the scene as of plane_tree_make, as far as known; NULL: one */
    row_source others;    /* readable after close: rows of F of an independent sample, entries in any order */
} row_stream;

#endif
