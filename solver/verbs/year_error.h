/* The error of the sum of a year, in place of the store's own. */
#ifndef LAMBERT_VERBS_YEAR_ERROR_H
#define LAMBERT_VERBS_YEAR_ERROR_H

#include "solver/light/annual.h"
#include "solver/light/sun_way.h"
#include "solver/verbs/own_error.h"

/* Replaces the error in out, whose one vector is a sum, by that of the mean light, of which the answer is
 * `scale` times; the part of the sun is the difference that was measured. *names as in own_error_take.
 * Nothing changes where the store states no error. Errors: LAM_ERR_MEMORY. */
lam_status year_error_take(const stated_errors *stated, const error_scene *scene, const lit_store *lit,
                           const emission *mean, const sun_way *way, double scale, size_t n_selected,
                           const uint32_t *selected, solution *out, name_error **names, lam_error *error);

#endif
