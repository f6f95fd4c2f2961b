/* Entries of W S W^T, W being a multiwavelet basis, while wavelet_pass.h finds them, and the sparse matrix
 * that is made of them. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_WAVELET_ENTRIES_H
#define LAMBERT_METHOD_HIERARCHICAL_WAVELET_ENTRIES_H

#include "solver/linalg/csr.h"
#include "solver/operator/wavelet/wavelets.h"

/* The coefficient (W S W^T)_ij, i <= j: (i, j) and (j, i) are equal, so that one of them is stored. */
typedef struct coefficient {
    uint32_t i, j;
    float value;
} coefficient;

typedef struct coefficient_list {
    coefficient *list;
    size_t count, capacity;
} coefficient_list;

void coefficient_list_free(coefficient_list *k);

/* Appends (i, j), or (j, i) where i > j. Errors: LAM_ERR_MEMORY. */
lam_status coefficient_list_add(coefficient_list *k, uint32_t i, uint32_t j, float value, lam_error *error);

/* The upper triangle [n][n] of the coefficients of all lists, with ascending columns, freed by the caller;
 * the lists are freed. A pair (i, j) that two lists hold stands there twice. Errors: LAM_ERR_MEMORY. */
lam_status coefficient_lists_join(size_t n, coefficient_list *lists, size_t n_lists, csr *out,
                                  lam_error *error);

/* S = S1 + S1^T in place, from the entries of W S1 W^T as coefficient_lists_join left them, where (i, j) and
 * (j, i) of S1 share a place: S_ij = S1_ij + S1_ji, S_ii = 2 S1_ii. Entries up to threshold weight_i weight_j
 * are dropped; weight is by node. Errors: LAM_ERR_MEMORY. */
lam_status wavelet_add_transpose(const wavelets *w, const float *weight, float threshold, csr *S,
                                 lam_error *error);

/* Scaling functions of a node, at most. */
enum { ENTRY_LANES = 3 };

/* Column j of the rows of S1 that a node a carries up: of[l] = (Phi_a S1 W^T)_lj, Phi_a the scaling functions
 * of a, and the weight of the node of j (wavelet_pass.h carries nodes finer than the parent of a alone). */
typedef struct fine_column {
    uint32_t j;
    float weight;
    float of[ENTRY_LANES];
} fine_column;

typedef struct fine_columns {
    size_t count, capacity;
    fine_column *list; /* j ascending */
} fine_columns;

void fine_columns_free(fine_columns *d);

/* Makes room for `more` further columns. Errors: LAM_ERR_MEMORY. */
lam_status fine_columns_reserve(fine_columns *d, size_t more, lam_error *error);

/* into = the union of a and of b [b_count], both ascending and without a common j. Errors: LAM_ERR_MEMORY. */
lam_status fine_columns_union(const fine_columns *a, const fine_column *b, size_t b_count, fine_columns *into,
                              lam_error *error);

/* A copy without spare room. Errors: LAM_ERR_MEMORY. */
lam_status fine_columns_copy(const fine_columns *from, fine_columns *out, lam_error *error);

#endif
