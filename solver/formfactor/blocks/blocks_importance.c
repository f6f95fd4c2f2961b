#include "solver/formfactor/blocks/blocks_importance.h"

#include <math.h>

/* Bounds of the blocks that the importance is found by, and the tolerance of single pairs. In an office of
 * 10,191 elements they take .1 s; what is read errs alike at a quarter of them and at ten times as much. */
static const double open_most = .02, shadow_most = .05, exact = 1e-2;

lam_status blocks_importance(const mesh *m, const visibility *v, const plane_tree *tree,
                             const block_options *options, importance *io, lam_error *error) {
    lam_status status = LAM_OK;
    block_options coarse = *options;
    block_factors made = {.n = 0};
    if (importance_is_found(io)) return LAM_OK;
    coarse.open = fmax(open_most, options->open);
    coarse.shadow = fmax(shadow_most, options->shadow);
    coarse.exact = exact;
    coarse.importance = NULL;
    coarse.stage = "importance";
    TRY(blocks_find(m, v, tree, &coarse, &made, NULL, error));
    const factor_product F = block_factors_product(&made);
    TRY(importance_find(&F, m->n_channels, m->reflectance, m->area, io, error));
done:
    block_factors_free(&made);
    return status;
}
