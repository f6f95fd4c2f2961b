/* Light that comes to elements, or to receivers, directly from m sources that are no elements: tiles of a
 * sky, luminaires. Row t of the matrix is the irradiance of every element by source t. */
#ifndef LAMBERT_OPERATOR_FIRST_ROWS_H
#define LAMBERT_OPERATOR_FIRST_ROWS_H

#include "store/store_map.h"

typedef struct first_rows {
    size_t m, n;
    const float *values; /* [m][n]; in where */
    store_view where;
} first_rows;

/* Factors of the weights of a row r: those of channel r % n_channels, [n_channels][m]. NULL: 1. */
typedef struct row_factors {
    size_t n_channels;
    const double *values;
} row_factors;

/* Reads the array of this name, [m][n] with m at least 1, in place where the store is mapped. is_signed [n]:
 * elements whose values may be negative, NULL: none. Errors: LAM_ERR_FORMAT (another shape, a value that is
 * negative or not finite), LAM_ERR_DAMAGED, LAM_ERR_MEMORY. */
lam_status first_rows_load(store *s, const char *name, const char *source, size_t n, const bool *is_signed,
                           first_rows *out, lam_error *error);

/* Copies values [m][n]. Errors: LAM_ERR_MEMORY. */
lam_status first_rows_copy(size_t m, size_t n, const float *values, first_rows *out, lam_error *error);

void first_rows_free(first_rows *r);

/* H0 [n_rows][n]: row q is sum_t w_qt f_qt values[t][.] of weights w [n_rows][m] and their factors f, and
 * with add that much more than it was. A source of weight 0 costs nothing; the bits of a row do not depend on
 * its neighbours. */
void first_rows_apply(const first_rows *r, size_t n_rows, const float *w, const row_factors *f, bool add,
                      float *H0);

/* The same in double, always added. */
void first_rows_apply_double(const first_rows *r, size_t n_rows, const double *w, const row_factors *f,
                             double *H0);

/* The transpose: w [n_rows][m], w_qt = f_qt sum_i values[t][i] g_qi of g [n_rows][n]. */
void first_rows_adjoint(const first_rows *r, size_t n_rows, const float *g, const row_factors *f, float *w);

#endif
