/* A forecast of the work that blocks_find is going to do, by a walk that visits a sample of its pairs. */
#ifndef LAMBERT_FORMFACTOR_BLOCKS_BLOCKS_SAMPLE_H
#define LAMBERT_FORMFACTOR_BLOCKS_BLOCKS_SAMPLE_H

#include "solver/formfactor/blocks/blocks.h"
#include "solver/formfactor/factor_cost.h"
#include "solver/operator/blocks/importance.h"

/* The walk of a sample: the work that it did, and the processor seconds that this took. */
typedef struct blocks_trial {
    block_report work;
    double seconds;
} blocks_trial;

/* About the report of blocks_find. It reads no clock: the same scene has the same figures, for any number of
 * threads. trial, or NULL, is of the walk itself. Cost: about a thirtieth of finding the blocks. Errors:
 * LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status blocks_sample(block_scene *scene, const block_options *options, block_report *out,
                         blocks_trial *trial, lam_error *error);

/* The cost of finding blocks by a recipe, from blocks_sample, and, with the importance of elements, of those
 * of a judge from another; NULL: all is read. Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status blocks_forecast(block_scene *scene, const recipe *r, const importance *read, const progress *p,
                           factor_cost *out, lam_error *error);

#endif
