/* The stated error of the answer for the scene's own lights and luminaires, as dim as these are listed: the
 * headline of a store of luminaires. No probe of the judge is such light; the laws of what it measured say
 * what an answer errs by, as for any other. */
#ifndef LAMBERT_PRECOMPUTE_OWN_ERROR_H
#define LAMBERT_PRECOMPUTE_OWN_ERROR_H

#include "solver/precompute/parts.h"

/* Fills out by figures, whose by_group is used and left as it is. out->known is false without luminaires,
 * without errors by group, where nothing shines or is reflected, and of a store for sources, which states
 * nothing of luminaires. Cost: one answer, and O(C n luminaires). Errors: LAM_ERR_MEMORY, and those of the
 * operator. */
lam_status own_error_find(const precompute_scene *scene, const lam_operator *op, stated_figures *figures,
                          own_figures *out, lam_error *error);

#endif
