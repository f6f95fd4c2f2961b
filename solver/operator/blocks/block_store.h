/* Blocks and their tree in /form_factors of a store (store/FORMAT.md, storage = blocks). */
#ifndef LAMBERT_OPERATOR_BLOCKS_BLOCK_STORE_H
#define LAMBERT_OPERATOR_BLOCKS_BLOCK_STORE_H

#include "solver/operator/blocks/block_range.h"
#include "store/store.h"

/* Nodes reach beyond their parents by no more than this share of them. */
#define BLOCK_OVERHANG 1e-6

/* Writes the nodes and blocks of f, their order and the balance, but not the numbers of a function along an
 * axis for nodes that have none. f has a balance. Errors: as store_write. */
lam_status block_factors_save(const block_factors *f, store *s, lam_error *error);

/* Reads the blocks of n elements with areas by element. Everything is checked: the tree, that nodes lie
 * within their parents (BLOCK_OVERHANG), that blocks are sorted, have no element on both sides and are
 * nowhere negative. f->tree is tree; the caller frees both, and the tree must outlive f. Errors: those of
 * store_read, LAM_ERR_FORMAT for a wrong value, which the message names. */
lam_status block_factors_load(store *s, size_t n, const double *area, plane_tree *tree, block_factors *f,
                              lam_error *error);

/* Bytes in memory of the blocks of a store: *kept once loaded, *most while loading. Errors: as
 * store_array_info. */
lam_status block_factors_stored(store *s, size_t *kept, size_t *most, lam_error *error);

/* Bytes in memory. */
size_t block_factors_bytes(const block_factors *f);

#endif
