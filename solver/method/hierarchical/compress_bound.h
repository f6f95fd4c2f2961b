/* Sizes behind the threshold and the error bound of compressed form factors: the largest values of the
 * wavelets of a node, the share of radiosity in each class of coefficients, and the bound of what was
 * dropped. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_COMPRESS_BOUND_H
#define LAMBERT_METHOD_HIERARCHICAL_COMPRESS_BOUND_H

#include "solver/operator/refine/compressed_factors.h"

/* S is symmetric up to rounding of F to single precision: |S_pq - S_qp| is at most this times the Frobenius
 * norm of the rows that p is made of. */
#define COMPRESS_ASYMMETRY 4e-7

typedef struct node_sizes {
    double wavelets; /* max over elements of the 2-norm of the values of the node's wavelets there */
    double inputs;   /* the same of its inputs */
    double rows;     /* Frobenius norm of the rows of A^1/2 F A^-1/2 of its elements */
} node_sizes;

/* Groups whose direct illumination is stored, at most. */
enum { COMPRESS_LIT_MOST = 16 };

/* F has rows with A_i F_ij = A_j F_ji up to rounding to single precision; area [n].
 * out [n_nodes], from the basis and order of c. Errors: LAM_ERR_MEMORY. */
lam_status compress_sizes(const csr *F, const double *area, const compressed_factors *c, node_sizes *out,
                          lam_error *error);

/* Sets lit, lit_group and n_lit of c: row sums of F over groups, of which those that shine come first, then
 * the largest. group [n] below n_groups; shines [n_groups], or NULL. Errors: LAM_ERR_MEMORY. */
lam_status compress_light_groups(const csr *F, const double *area, const uint32_t *group, size_t n_groups,
                                 const bool *shines, compressed_factors *c, lam_error *error);

/* share [n_classes]: the typical share of the norm of a radiosity that lies in the coefficients of a class,
 * above 0. It is measured on the direct illumination by groups. Errors: LAM_ERR_MEMORY. */
lam_status compress_shares(const double *area, const compressed_factors *c, double *share, lam_error *error);

/* Sets bound of c from the sums of squares of dropped coefficients, lost [n_nodes][n_classes]. Errors:
 * LAM_ERR_MEMORY. */
lam_status compress_bounds(const node_sizes *sizes, const double *lost, compressed_factors *c,
                           lam_error *error);

#endif
