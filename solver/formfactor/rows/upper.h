/* Exchange areas g_ij = A_i F_ij = g_ji by their upper triangle, j > i, as sparse rows: from rows as they
 * were found, and to whole rows. */
#ifndef LAMBERT_FORMFACTOR_ROWS_UPPER_H
#define LAMBERT_FORMFACTOR_ROWS_UPPER_H

#include "solver/formfactor/rows/row_code.h"
#include "solver/linalg/csr.h"
#include "solver/operator/refine/form_factor_rows.h"

/* Merges c_ij and c_ji of rows (rays each; weights as if of one ray) into
 *     g_ij = (c_ij + c_ji)/rays * A_i A_j/(A_i + A_j)
 * which weighs the two estimates of g, of variance ~ A_i g/rays and ~ A_j g/rays, by their inverse variances.
 * A few columns at a time: beside rows and upper, which the caller frees with csr_free, it takes about 100
 * MB; with a place, upper lies there. The same for any number of threads. LAM_ERR_MEMORY, LAM_ERR_IO. */
lam_status upper_merge(const packed_rows *rows, size_t rays, const double *area, const large_place *place,
                       csr *upper, lam_error *error);

/* Turns exchange areas into the rows of F, in place: upper becomes F. Beside F it takes about 100 MB.
 * row_sums, [n], gets the sums of F's rows. On an error upper may be lost; it is still freed by csr_free. */
lam_status upper_expand(csr *upper, const double *area, double *row_sums, lam_error *error);

/* The reverse, in place, exact for rows that upper_expand made: what the result expands to has their bits. */
lam_status upper_gather(csr *F, const double *area, lam_error *error);

#endif
