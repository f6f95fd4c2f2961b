/* The upper triangle, j > i, of exchange areas g_ij = A_i F_ij = A_j F_ji: merged from the two estimates of
 * each pair in one-sided rows, and expanded to rows of F. */
#ifndef LAMBERT_FORMFACTOR_ROWS_UPPER_H
#define LAMBERT_FORMFACTOR_ROWS_UPPER_H

#include "solver/formfactor/rows/row_code.h"
#include "solver/linalg/csr.h"
#include "solver/operator/refine/form_factor_rows.h"

/* Merges the entries c_ij and c_ji of rows (counts of rays; weights count as one ray) into
 *     g_ij = (c_ij + c_ji)/rays * A_i A_j/(A_i + A_j)
 * the mean of the two estimates of g, of variance ~ A_i g/rays and ~ A_j g/rays, by their inverse variances.
 * Works on a few columns at a time: beside rows and upper, which the caller frees with csr_free, it takes
 * about 100 MB. With a place, upper lies there. The same for any number of threads. Errors: LAM_ERR_MEMORY,
 * LAM_ERR_IO. */
lam_status upper_merge(const packed_rows *rows, size_t rays, const double *area, const large_place *place,
                       csr *upper, lam_error *error);

/* Turns exchange areas into the rows of F, in place: upper becomes F. Beside F it takes about 100 MB. Writes
 * the sums of F's rows to row_sums, [n]. After an error upper can only be freed by csr_free. */
lam_status upper_expand(csr *upper, const double *area, double *row_sums, lam_error *error);

/* The inverse, in place, exact for rows of upper_expand: expanded again, they have the same bits. */
lam_status upper_gather(csr *F, const double *area, lam_error *error);

#endif
