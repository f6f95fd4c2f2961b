/* The places of elements in the nodes of blocks, and the least value of a block over them: form factors are
 * not negative.
 *
 * m_t(i) goes from -1 to 1 across node t, and along each axis its elements lie between low and high. The
 * density of a block, m_a^T L m_b, is linear in each of the four coordinates by itself, so that it is least
 * at corners of the two rectangles low ... high. */
#ifndef LAMBERT_OPERATOR_BLOCKS_BLOCK_RANGE_H
#define LAMBERT_OPERATOR_BLOCKS_BLOCK_RANGE_H

#include "solver/operator/blocks/block_factors.h"

/* Levels of clusters for which the bounds below count the rounding. */
enum { BLOCK_DEPTH_MOST = 256 };

/* Both are 0 along an axis without a function. */
typedef struct block_range {
    double low[2], high[2];
} block_range;

/* The ranges of all nodes, [n_clusters + n], freed with free. Errors: LAM_ERR_MEMORY. */
lam_status block_ranges(const block_factors *f, block_range **out, lam_error *error);

/* sum |L_rc|, which bounds the density of a block on its nodes. */
double block_magnitude(const cluster_block *k);

/* A lower and an upper bound of the density of a block in 1/m^2, whose numbers are finite. */
double block_least(const block_range *ranges, const cluster_block *k);
double block_most(const block_range *ranges, const cluster_block *k);

/* Makes all blocks of f non-negative: where one falls below 0, its slopes are changed as little as possible
 * in the 2-norm over both nodes; the value at their centres stays, unless it is negative itself. Returns the
 * number of these blocks in n_reduced (may be NULL). Cost: O(n + n_blocks). Errors: LAM_ERR_MEMORY. */
lam_status block_factors_reduce(block_factors *f, size_t *n_reduced, lam_error *error);

#endif
