/* How many elements an element sees: rows of F that are looked at and dropped. */
#ifndef LAMBERT_FORMFACTOR_SEEN_H
#define LAMBERT_FORMFACTOR_SEEN_H

#include "solver/base/progress.h"
#include "solver/formfactor/recipe.h"
#include "solver/scene/mesh.h"

/* seen[k]: how many elements elements[k], which are all different, finds by the recipe, RECIPE_RAYS or
 * RECIPE_HEMICUBE: entries of the row as it is found, before the two estimates of a pair are merged, which is
 * how "Aguerre 2016, table 4.1" counts. The same for any number of threads. Cost: that of count rows.
 * Errors: LAM_ERR_ARGUMENT for another recipe, LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
lam_status seen_count(const mesh *m, const recipe *how, const uint32_t *elements, size_t count,
                      const progress *steps, const char *stage, size_t *seen, lam_error *error);

#endif
