/* Random blocks of form factors on a tree, and the dense matrix of any blocks. */
#ifndef LAMBERT_TESTS_RANDOM_BLOCKS_H
#define LAMBERT_TESTS_RANDOM_BLOCKS_H

#include "solver/linalg/csr.h"
#include "solver/operator/blocks/block_factors.h"
#include "support/dense.h"

/* m_t(i), i by position. */
void block_functions_at(const block_factors *f, uint32_t t, size_t i, double m[BLOCK_FUNCTIONS]);

/* Adds a block to F and the magnitudes of its terms to `size`, in both directions: [n][n] by position. */
void block_add_dense(const block_factors *f, const cluster_block *k, double *F, double *size);

/* Fills f with what is found in `rounds` trials, in either direction; a pair of elements is in one block at
 * most. */
void random_blocks(block_factors *f, size_t rounds, uint64_t *seed);

/* Fills f with blocks of two elements each, from rows of F by element; of each pair the row of the first
 * element counts. */
void blocks_of_pairs(const csr *F, block_factors *f);

#endif
