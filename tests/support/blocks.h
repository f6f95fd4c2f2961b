/* Form factors by blocks as tests find them: balanced by nothing, with products by element. */
#ifndef LAMBERT_TESTS_BLOCKS_H
#define LAMBERT_TESTS_BLOCKS_H

#include "solver/formfactor/blocks/blocks.h"
#include "support/suite.h"

#include <stdlib.h>

/* The bounds that `lambert precompute` takes at its defaults. */
static const double blocks_open = 4e-4, blocks_shadow = 4e-3 / 3;

/* Finds blocks with these bounds and the seed 1, single pairs to 1e-6, on a tree that the caller frees. */
block_factors blocks_of(const mesh *m, plane_tree *tree, double open, double shadow, block_report *report);

/* The same with all options. */
block_factors blocks_with(const mesh *m, plane_tree *tree, const block_options *options,
                          block_report *report);

/* The same at those defaults, of a seed; segments of odd ones go through the whole scene. */
block_factors blocks_of_seed(const mesh *m, plane_tree *tree, uint64_t seed);

/* y = F x, by element. */
void blocks_multiply(const block_factors *f, const double *x, double *y);

/* The exchange area sum A_i F_ij, i in [from, from + n_from), j in [to, to + n_to). */
double blocks_exchange(const mesh *m, const block_factors *f, size_t from, size_t n_from, size_t to,
                       size_t n_to);

#endif
