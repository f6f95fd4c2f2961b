/* Form factors kept as blocks, and the bounds that a certificate needs of them.
 *
 * F is that of the numbers as stored, in exact arithmetic:
 *     F_ij = A_j d_i d_j f(i, j),   f(i, j) = m_a(i)^T L m_b(j)   (block_factors.h; d the balance).
 * No block is negative (block_range.h), so that A = I - R F has no positive entry off its diagonal, as
 * refinement.h needs.
 *
 * A product adds moments from the elements up the tree, takes them through the blocks, and goes down again.
 * Functions of a node are at most 1 + BLOCK_OVERHANG, and so is the sum |shift| + |scale| of each step
 * between levels: after D levels magnitudes are at most g = (1 + BLOCK_OVERHANG)^D times those of the
 * elements below. Each level rounds its numbers at most a few times, relative to their magnitudes, and a node
 * adds up at most q blocks. With K roundings in all, by the usual bound of sums (Higham 2002, section 3.1),
 *     |fl(F x) - F x|_i <= K u / (1 - K u) g^2 d_i sum |L|_1 A_j d_j |x_j|
 * over the blocks of all nodes above i and the elements j on their other sides; |L|_1 is the sum of |L_rc|.
 * rounding is the largest of these for |x| = 1. It does not depend on x but by |x|_max. */
#ifndef LAMBERT_OPERATOR_REFINE_KEPT_BLOCKS_H
#define LAMBERT_OPERATOR_REFINE_KEPT_BLOCKS_H

#include "solver/operator/blocks/block_store.h"

typedef struct kept_blocks {
    plane_tree tree;
    block_factors f;
    double rounding; /* of (F x)_i over |x|_max */
} kept_blocks;

void kept_blocks_free(kept_blocks *k);

/* From blocks after block_factors_end with a balance, whose tree is `tree`; both are taken over, also on an
 * error; out must stay where it is. Sets rounding, and by element upper bounds of the row sums of F and of
 * its row norms (sum_j F_ij^2 / A_j)^1/2, both [n]. Cost: some products. Errors: LAM_ERR_MEMORY;
 * LAM_ERR_FORMAT when a row sum is above most. */
lam_status kept_blocks_make(plane_tree *tree, block_factors *f, double most, kept_blocks *out,
                            double *row_sums, double *row_norms, lam_error *error);

/* Reads them from a store, with areas by element. Errors: those of block_factors_load and of
 * kept_blocks_make. */
lam_status kept_blocks_load(store *s, size_t n, const double *area, double most, kept_blocks *out,
                            double *row_sums, double *row_norms, lam_error *error);

/* Bytes that a product reads: each block as either side's. */
size_t kept_blocks_bytes(const kept_blocks *k);

#endif
