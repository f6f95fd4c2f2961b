/* What numbers of compressed form factors are worth: how large the wavelets of a node are, how much of them
 * light has, and from both the bounds of what was left out. */
#ifndef LAMBERT_METHOD_HIERARCHICAL_COMPRESS_BOUND_H
#define LAMBERT_METHOD_HIERARCHICAL_COMPRESS_BOUND_H

#include "solver/method/hierarchical/compress.h"

/* F is symmetric but for rounding to single precision, and so are numbers that are kept: of the Frobenius
 * norm of the rows that a number is made of. */
#define COMPRESS_ASYMMETRY 4e-7

/* Of the nodes of a basis. */
typedef struct node_sizes {
    double wavelets, inputs; /* the largest norm at an element of its wavelets' values, of all it takes */
    double rows;             /* Frobenius norm of the rows of A^1/2 F A^-1/2 of its elements */
} node_sizes;

/* out [n_nodes]; c has its basis and order. Errors: LAM_ERR_MEMORY. */
lam_status compress_sizes(const compress_input *input, const compressed_factors *c, node_sizes *out,
                          lam_error *error);

/* lit, lit_group, n_lit of c. Errors: LAM_ERR_MEMORY. */
lam_status compress_light_groups(const compress_input *input, compressed_factors *c, lam_error *error);

/* share [n_classes]: of the norm of light, about, what the coefficients of a class have, as it is in first
 * light of groups less its means; never nothing. Errors: LAM_ERR_MEMORY. */
lam_status compress_shares(const compress_input *input, const compressed_factors *c, double *share,
                           lam_error *error);

/* bound of c, from the squares of what was lost [n_nodes][n_classes]. Errors: LAM_ERR_MEMORY. */
lam_status compress_bounds(const node_sizes *sizes, const double *lost, compressed_factors *c,
                           lam_error *error);

#endif
