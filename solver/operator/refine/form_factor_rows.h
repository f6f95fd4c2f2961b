/* Reads and checks /form_factors of a store and holds rows of F at run time. It knows areas of the mesh
 * alone, and not how form factors were computed. */
#ifndef LAMBERT_OPERATOR_REFINE_FORM_FACTOR_ROWS_H
#define LAMBERT_OPERATOR_REFINE_FORM_FACTOR_ROWS_H

#include "solver/linalg/csr.h"
#include "solver/operator/refine/kept_blocks.h"

#include <math.h>

/* F_ij from g_ij = A_i F_ij, so that F_ij and F_ji are rounded from one number. */
static inline float upper_factor(float exchange, double area) {
    return (float)fmin((double)exchange / area, 1);
}

/* Reads the form factors of n elements: held is F when *rows is true, else g_ij = A_i F_ij for j > i. Every
 * entry must be from 0 to 1 and every row sum, which goes to row_sums [n], at most glass_row_most (1 + 1e-5).
 * held lies in place (NULL: in memory), and the caller frees it with csr_free, also after an error. Errors:
 * LAM_ERR_FORMAT, LAM_ERR_UNSUPPORTED (another storage), those of store_read and csr_reserve. */
lam_status form_factor_rows_read(store *s, size_t n, const double *area, const large_place *place, csr *held,
                                 bool *rows, double *row_sums, lam_error *error);

/* The forms in which a store keeps its form factors. */
typedef enum form_factor_storage {
    STORAGE_ROWS,
    STORAGE_UPPER,
    STORAGE_BLOCKS,
    STORAGES
} form_factor_storage;

/* Finds how a store that has form factors holds them. Errors: those of store_get_text; LAM_ERR_UNSUPPORTED
 * for another storage, such as compressed coefficients. */
lam_status form_factors_storage(store *s, form_factor_storage *out, lam_error *error);

/* F of an open store, as rows or as blocks; the certificate of a refined answer refers to it. */
struct lam_form_factors {
    size_t n;
    csr F;               /* rows; else empty */
    double *area;        /* [n], m^2 */
    double *row_sums;    /* [n], of F */
    double *row_norms;   /* [n], (sum_j F_ij^2 / A_j)^1/2 */
    uint64_t longest;    /* entries of the longest row */
    kept_blocks *blocks; /* NULL: not so */
};

/* Loads them; *out = NULL when the store has none. lam_form_factors_close frees them. Errors: as
 * form_factor_rows_read. */
lam_status form_factors_open(store *s, lam_form_factors **out, lam_error *error);

/* From rows in memory (taken over, also on an error) and areas [n] (copied). */
lam_status form_factors_of_rows(csr *F, const double *area, lam_form_factors **out, lam_error *error);

/* From blocks with a balance and their tree (taken over, also on an error). Errors: those of
 * kept_blocks_make. */
lam_status form_factors_of_blocks(plane_tree *tree, block_factors *f, lam_form_factors **out,
                                  lam_error *error);

/* Memory of form_factors_open in bytes: *kept after loading, *most while loading. Errors:
 * those of store_get_text and store_array_info, LAM_ERR_UNSUPPORTED. */
lam_status form_factors_size(store *s, size_t *kept, size_t *most, lam_error *error);

#endif
