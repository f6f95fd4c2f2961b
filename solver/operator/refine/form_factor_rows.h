/* The entries of /form_factors of a store: read, checked, and at run time held as rows of F. Knows no mesh
 * but its areas, and nothing of how form factors are found. */
#ifndef LAMBERT_OPERATOR_REFINE_FORM_FACTOR_ROWS_H
#define LAMBERT_OPERATOR_REFINE_FORM_FACTOR_ROWS_H

#include "solver/linalg/csr.h"
#include "solver/operator/refine/compressed_factors.h"

#include <math.h>

#define FORM_FACTORS_GROUP "/form_factors"

/* F_ij from g_ij = A_i F_ij: both ends of a pair are rounded from one number. */
static inline float upper_factor(float exchange, double area) {
    return (float)fmin((double)exchange / area, 1);
}

/* Reads what the store holds for n elements: *rows says whether `held` is F[i][.], or g_ij = A_i F_ij for
 * j > i. Every entry is checked to be a share, every row sum to be at most 1 (+ 1e-5); row_sums, [n], gets
 * them. held lies in place (NULL: in memory) and is freed with csr_free, also after an error.
 * Errors: LAM_ERR_FORMAT, LAM_ERR_UNSUPPORTED (another storage), those of store_read and csr_reserve. */
lam_status form_factor_rows_read(store *s, size_t n, const double *area, const large_place *place, csr *held,
                                 bool *rows, double *row_sums, lam_error *error);

/* F of an open store, as rows or compressed: what refined answers are judged by. */
struct lam_form_factors {
    size_t n;
    csr F;                          /* no rows where it is compressed */
    double *area;                   /* [n], m^2 */
    double *row_sums;               /* [n], of F */
    double *row_norms;              /* [n], (sum_j F_ij^2 / A_j)^1/2; NULL where it is compressed */
    uint64_t longest;               /* entries of the longest row */
    compressed_factors *compressed; /* NULL: rows */
};

/* Loads them, or NULL where the store keeps none; freed by lam_form_factors_close. Errors as above. */
lam_status form_factors_open(store *s, lam_form_factors **out, lam_error *error);

/* Of rows that are there already (taken over, also on an error) and areas [n] (copied). */
lam_status form_factors_of_rows(csr *F, const double *area, lam_form_factors **out, lam_error *error);

/* Of compressed ones (taken over, also on an error), finished, and areas and row sums of F [n] (copied). */
lam_status form_factors_of_compressed(compressed_factors *c, const double *area, const double *row_sums,
                                      lam_form_factors **out, lam_error *error);

/* Whether the store has form factors as rows or pairs, not compressed ones. Errors: as store_get_text. */
lam_status form_factors_in_rows(store *s, bool *in_rows, lam_error *error);

/* Bytes that form_factors_open takes of a store that has them: for good, and at most on the way. Errors:
 * those of store_get_text and store_array_info, LAM_ERR_UNSUPPORTED. */
lam_status form_factors_size(store *s, size_t *kept, size_t *most, lam_error *error);

#endif
