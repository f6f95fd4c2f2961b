/* Where the rows of F come from: memory, a file, or rays. A factorizer asks for blocks of rows and is told
 * how often it has been over all of them. */
#ifndef LAMBERT_LINALG_ROW_SOURCE_H
#define LAMBERT_LINALG_ROW_SOURCE_H

#include "solver/linalg/csr.h"

/* Rows of some elements: row k begins at data + begin[k] and has length[k] entries, indices ascending. What
 * owned holds is freed by row_block_free. */
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
    double density; /* share of the n^2 entries that are there, about */
    /* The rows of elements[0] ... elements[m-1]. Any number of threads may ask at once. */
    lam_status (*rows)(void *context, const uint32_t *elements, size_t m, row_block *out, lam_error *error);
    void *context;
    uint64_t rows_given; /* counted by row_source_get */
} row_source;

/* Rows of F, which must outlive the source, from memory: nothing is copied. */
void row_source_of_csr(row_source *source, const csr *F);

/* The rows of elements[0] ... elements[m-1], freed by row_block_free. Errors: LAM_ERR_MEMORY, what the source
 * says. */
lam_status row_source_get(row_source *source, const uint32_t *elements, size_t m, row_block *out,
                          lam_error *error);

/* How often all rows have been asked for. */
double row_source_passes(const row_source *source);

/* Rows of F that are found as they are asked for and not kept. */
typedef struct row_stream {
    row_source rows; /* of F1, one side: A F = A F1 + F1^T A; each once; entries in any sequence, an index any
                        number of times */
    /* After all of them, once: what rows of F sum to when they are scaled to close, [n], which lives as long
     * as the stream. */
    lam_status (*close)(void *context, const double **row_sums, lam_error *error);
    void *context;     /* of close */
    row_source others; /* then: rows of F by another sample; entries likewise */
} row_stream;

#endif
