/* S = A^1/2 F A^-1/2, the symmetric form of F, as dense column blocks and as products. Its 2-norm is at most
 * 1 whatever the areas. Knows no method that uses it. */
#ifndef LAMBERT_MATRIX_SCALED_H
#define LAMBERT_MATRIX_SCALED_H

#include "solver/operator/csr.h"

typedef struct scaled_matrix {
    const csr *F;
    double *root_area; /* [n], A^1/2 */
} scaled_matrix;

/* F and area must keep reciprocity; F must outlive S. Freed by scaled_free. */
lam_status scaled_init(scaled_matrix *S, const csr *F, const double *area, lam_error *error);
void scaled_free(scaled_matrix *S);

/* The columns of elements columns[0] ... columns[m-1] as block [m][n]: one column after the other, rows in
 * mesh order. Column e of S is its row e. Cost: O(nm). */
void scaled_columns(const scaled_matrix *S, const uint32_t *columns, size_t m, float *block);

/* y = S x in double; x and y are [n]. Cost: O(nnz). */
void scaled_multiply(const scaled_matrix *S, const double *x, double *y);

#endif
