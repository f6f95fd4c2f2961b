/* The importance of elements by coarse blocks, before those that it steers are found. */
#ifndef LAMBERT_FORMFACTOR_BLOCKS_BLOCKS_IMPORTANCE_H
#define LAMBERT_FORMFACTOR_BLOCKS_BLOCKS_IMPORTANCE_H

#include "solver/formfactor/blocks/blocks.h"
#include "solver/operator/blocks/importance.h"

/* Finds io (importance_find) where it is not found. tree, v and m as for blocks_find. The bits do not depend
 * on the number of threads. Cost: that of blocks to within .02, and some products. Errors: LAM_ERR_MEMORY,
 * LAM_ERR_CANCELLED. */
lam_status blocks_importance(const mesh *m, const visibility *v, const plane_tree *tree,
                             const block_options *options, importance *io, lam_error *error);

#endif
