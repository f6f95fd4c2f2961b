/* S = P A^1/2 F A^-1/2 P^T, the symmetric form of F with rows and columns in the order of a curve, as blocks
 * of sparse columns and as products. Its 2-norm is at most 1 whatever the areas. Rows and columns
 * are positions on the curve. It knows no method. */
#ifndef LAMBERT_LINALG_SCALED_H
#define LAMBERT_LINALG_SCALED_H

#include "solver/linalg/row_source.h"

typedef struct scaled_matrix {
    size_t n;
    row_source *rows;      /* of F */
    const uint32_t *order; /* [n], position -> element */
    uint32_t *position;    /* [n], element -> position */
    double *root_area;     /* [n], A^1/2, by element */
} scaled_matrix;

/* F (of which rows is the source) and area must keep reciprocity; rows and order must outlive S. Freed by
 * scaled_free. Errors: LAM_ERR_MEMORY. */
lam_status scaled_init(scaled_matrix *S, row_source *rows, const double *area, const uint32_t *order,
                       lam_error *error);
void scaled_free(scaled_matrix *S);

/* Consecutive columns of S, stored by rows: columns[p] counts from the first column of the block. */
typedef struct sparse_block {
    size_t n, m;
    uint64_t *indptr;  /* [n + 1] */
    uint32_t *columns; /* [nnz], ascending in a row */
    float *data;       /* [nnz] */
} sparse_block;

void sparse_block_free(sparse_block *block);

/* Columns first ... last-1. S is symmetric, so these are rows of F. Cost: O(n + nnz of the block). Errors:
 * LAM_ERR_MEMORY, those of the source. */
lam_status scaled_block(const scaled_matrix *S, size_t first, size_t last, sparse_block *out,
                        lam_error *error);

/* Y = S X for w vectors, X and Y [n][w], in single precision (sums over n in groups of 256 terms); one pass
 * over F. Errors: LAM_ERR_MEMORY, those of the source. Cost: O(nnz w). */
lam_status scaled_multiply(const scaled_matrix *S, size_t w, const float *X, float *Y, lam_error *error);

/* y = S x in double; one pass over F. */
lam_status scaled_multiply_double(const scaled_matrix *S, const double *x, double *y, lam_error *error);

/* dense = S, [n][n], column by column; one pass over F. */
lam_status scaled_dense(const scaled_matrix *S, float *dense, lam_error *error);

#endif
