/* Sparse rows (CSR) in single precision with products in double. */
#ifndef LAMBERT_LINALG_CSR_H
#define LAMBERT_LINALG_CSR_H

#include "store/large_file.h"
#include "store/store.h"

#include <stdint.h>

typedef struct csr {
    size_t n;          /* rows and columns */
    uint64_t *indptr;  /* [n+1] */
    uint32_t *indices; /* [nnz], ascending in a row */
    float *data;       /* [nnz] */
    /* NULL: indices and data lie in memory; else in files of this place. */
    const large_place *place;
    large_file *files[2];
} csr;

void csr_free(csr *a);

/* Resizes indices and data to `entries`, more or fewer than now, and keeps their content; pages that are
 * never written take no memory. Errors: LAM_ERR_MEMORY, LAM_ERR_IO; a then keeps its content, and one of the
 * two arrays may be larger. */
lam_status csr_reserve(csr *a, size_t entries, lam_error *error);

/* Fill rows in any order. The caller puts the number of entries of row i into indptr[i + 1]; csr_begin_rows
 * turns these into begins and allocates indices and data (LAM_ERR_MEMORY, naming what). The caller then puts
 * each entry of row i at indptr[i]++, and csr_end_rows restores the begins. */
lam_status csr_begin_rows(csr *a, const char *what, lam_error *error);
void csr_end_rows(csr *a);

/* The first row of part k of n_parts, which hold about as many entries each; n for k = n_parts. */
size_t csr_part(const csr *a, size_t k, size_t n_parts);

/* indptr ascending from 0 to nnz, indices ascending and below n, data finite. LAM_ERR_FORMAT names the row.
 */
lam_status csr_check(const csr *a, size_t nnz, const char *name, lam_error *error);

/* The three arrays in a store: NAME/indptr [n+1] u64, NAME/indices u32, NAME/data f32. Loading fills n,
 * checks that indptr ends where the others do and leaves the rest to csr_check. Errors: as store_read. */
lam_status csr_save(const csr *a, const char *name, store *s, lam_error *error);
lam_status csr_load(store *s, const char *name, size_t n, csr *out, lam_error *error);

/* Y[first..last) = A X for rows first <= i < last: X and Y are [n][m] row-major, double. */
void csr_multiply_rows(const csr *a, size_t first, size_t last, size_t m, const double *X, double *Y);

/* out = A with the entries of B added or put in place of its own, without entries that are 0; the caller
 * frees it with csr_free. Both have n rows. It lies in the place of A. Cost: O(nnz). Errors:
 * LAM_ERR_ARGUMENT, LAM_ERR_MEMORY, LAM_ERR_IO. */
lam_status csr_replace(const csr *A, const csr *B, csr *out, lam_error *error);

/* Both triangles of a symmetric matrix from its upper one, whose rows ascend, without zeros; freed with
 * csr_free. Cost: O(nnz). Errors: LAM_ERR_MEMORY, naming what. */
lam_status csr_mirror(const csr *upper, const char *what, csr *out, lam_error *error);

#endif
