/* The arrays of a hierarchical operator. */
#ifndef LAMBERT_OPERATOR_HIERARCHICAL_H
#define LAMBERT_OPERATOR_HIERARCHICAL_H

#include "solver/linalg/csr.h"
#include "solver/operator/operator.h"
#include "solver/operator/wavelet/wavelets.h"

/* H_c = A^-1/2 W^T K_c W A^1/2 E_c, with K_c = W A^1/2 F (I - R_c F)^-1 A^-1/2 W^T, symmetric whatever R is,
 * of which entries below the threshold are left out. */
typedef struct hierarchical_arrays {
    wavelets basis;
    csr *K; /* [C], of n rows each: the upper triangle, the diagonal included */
} hierarchical_arrays;

void hierarchical_arrays_free(hierarchical_arrays *arrays, size_t n_channels);

/* area [n] is by position, that is in the order of the basis, which order [n] says (copied; NULL: mesh
 * order). Numbers of K are rounded to half precision. Takes over what arrays points to, also on an error, and
 * zeroes it. Errors: as operator_init; LAM_ERR_NUMERIC for an area or a number that cannot be. */
lam_status operator_hierarchical_create(size_t n, size_t n_channels, const float *reflectance,
                                        const double *area, const uint32_t *order,
                                        hierarchical_arrays *arrays, lam_operator **op, lam_error *error);

/* H += missing (sum_j A_j E_j) / light from now on (mean_correction.h): missing [C][n], by position, is what
 * op lacks of the irradiance that a light E0 brings, light [C] the area-weighted sum of E0. Once at most.
 * Errors: as mean_correction_create. */
lam_status operator_hierarchical_correct(lam_operator *op, const double *missing, const double *light,
                                         lam_error *error);

/* A symmetric matrix with its numbers in half precision, times scale; defined in hierarchical_store.c. */
typedef struct half_matrix {
    size_t n;               /* rows and columns, empty ones included */
    csr rows;               /* all of it, both triangles */
    const uint32_t *number; /* of its rows and columns, ascending; NULL: all n. Not owned */
    float scale;
} half_matrix;

/* From the upper triangle of a; its numbers are rounded. Errors: LAM_ERR_NUMERIC, LAM_ERR_MEMORY. */
lam_status half_matrix_create(const csr *a, half_matrix *out, lam_error *error);

/* Leaves out rows and columns that are not among number [count], which has all that are not empty and must
 * outlive m. Errors: LAM_ERR_MEMORY. */
lam_status half_matrix_compact(half_matrix *m, const uint32_t *number, size_t count, lam_error *error);

/* Both triangles of a symmetric matrix from its upper one, without zeros; freed with csr_free. Errors:
 * LAM_ERR_MEMORY. */
lam_status csr_mirror(const csr *upper, csr *out, lam_error *error);

/* GROUP/count [n] u16 (u32 where a row has more than 65,535), gap [nnz] u16, data [nnz] f16, and the group's
 * attribute scale. Errors: as store_read; LAM_ERR_FORMAT where they do not fit together. */
lam_status half_matrix_save(const half_matrix *m, const char *group, store *s, lam_error *error);
lam_status half_matrix_load(store *s, const char *group, size_t n, half_matrix *out, lam_error *error);

#endif
