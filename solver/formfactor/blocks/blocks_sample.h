/* A forecast of the work that blocks_find is going to do, by a walk that visits a sample of its pairs. */
#ifndef LAMBERT_FORMFACTOR_BLOCKS_BLOCKS_SAMPLE_H
#define LAMBERT_FORMFACTOR_BLOCKS_BLOCKS_SAMPLE_H

#include "solver/formfactor/blocks/blocks.h"

/* About the report of blocks_find. No clock is read: the same scene has the same figures, for any number of
 * threads. Cost: about a thirtieth of finding the blocks. Errors: LAM_ERR_MEMORY,
 * LAM_ERR_CANCELLED. */
lam_status blocks_sample(const mesh *m, const visibility *v, const plane_tree *tree,
                         const block_options *options, block_report *out, lam_error *error);

typedef struct blocks_cost {
    double seconds; /* of one thread */
    double blocks;
} blocks_cost;

/* The cost of finding blocks by a recipe, from blocks_sample and fixed costs of each kind of work. Errors:
 * LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status blocks_forecast(const mesh *m, const plane_tree *tree, const recipe *r, const progress *p,
                           blocks_cost *out, lam_error *error);

#endif
