/* Pairs taken one by one as a recipe has it. */
#ifndef LAMBERT_FORMFACTOR_PAIRS_RECIPE_PAIRS_H
#define LAMBERT_FORMFACTOR_PAIRS_RECIPE_PAIRS_H

#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/visibility/visibility.h"

/* The exchange areas of all pairs whose unoccluded mean factor is above `threshold` as an upper triangle,
 * which the caller frees: of threshold 0 without those that are hidden, else with a 0 for them. Fills
 * f->pairs and rows_kept. Errors: as of form_factors_make. */
lam_status recipe_pairs_find(const mesh *m, const visibility *v, const form_factor_options *options,
                             double threshold, form_factors *f, csr *G, lam_error *error);

#endif
