/* Rows of weights: a sparse matrix, most rows of which are means of four numbers, beside each other in grids.
 */
#ifndef LAMBERT_OPERATOR_CORNERS_CORNER_ROWS_H
#define LAMBERT_OPERATOR_CORNERS_CORNER_ROWS_H

#include "store/status.h"

#include <stdint.h>

typedef struct corner_rows {
    size_t n_rows;
    uint32_t *first;   /* [n_rows + 1]: entries of row j are first[j] ... first[j + 1] - 1 */
    uint32_t *columns; /* [first[n_rows]], of a row ascending */
    float *weights;    /* [first[n_rows]] */
    bool *even;        /* [n_rows]: all weights of the row are equal, 1 over their number */
    uint16_t *run;     /* [n_rows]: 0, or how many rows from this one on are even, of four columns, each one
                          behind that of the row before; known after corner_rows_end */
    size_t capacity;   /* while rows are added */
} corner_rows;

/* Starts with no rows, of n_rows at most; rows is zeroed, and freed by corner_rows_free also after an error.
 * Errors: LAM_ERR_MEMORY. */
lam_status corner_rows_begin(corner_rows *rows, size_t n_rows, lam_error *error);
void corner_rows_free(corner_rows *rows);

/* Appends a row. Weights that differ from their mean by 1e-6 of it alone are made equal. Errors:
 * LAM_ERR_MEMORY, LAM_ERR_ARGUMENT (more than 2^32 weights). */
lam_status corner_rows_add(corner_rows *rows, size_t count, const uint32_t *columns, const double *weights,
                           lam_error *error);

/* Gives room behind the last row back, and finds runs. Errors: LAM_ERR_MEMORY. */
lam_status corner_rows_end(corner_rows *rows, lam_error *error);

size_t corner_rows_bytes(const corner_rows *rows);

/* out [n_vectors][n_rows] = rows x for vectors x [n_vectors][width]; of a row without entries out stays.
 * Entries are added ascending; a vector's bits do not depend on its neighbours. */
void corner_rows_apply(const corner_rows *rows, size_t n_vectors, size_t width, const float *x, float *out);

/* out = 2 out - rows x, likewise. */
void corner_rows_reflect(const corner_rows *rows, size_t n_vectors, size_t width, const float *x, float *out);

/* x += factor rows^T g. */
void corner_rows_transpose(const corner_rows *rows, float factor, const float *g, float *x);

#endif
