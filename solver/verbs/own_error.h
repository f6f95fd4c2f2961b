/* The error of the light that a lambert solve asked for, in place of the store's own. */
#ifndef LAMBERT_VERBS_OWN_ERROR_H
#define LAMBERT_VERBS_OWN_ERROR_H

#include "solver/operator/stated/stated_errors.h"
#include "solver/output/output.h"
#include "solver/verbs/light_options.h"

/* Replaces the error in out, of a batch by the largest over its vectors, where the store states what it
 * takes: errors by group, or the covariance of its emitters for whole answers. *names (freed with free()
 * after the answer is written) belongs to out. Errors: LAM_ERR_MEMORY. */
lam_status own_error_take(const stated_errors *stated, const error_scene *scene, const lit_store *lit,
                          size_t n_selected, const uint32_t *selected, solution *out, name_error **names,
                          lam_error *error);

#endif
