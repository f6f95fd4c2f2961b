/* The error of a lambert solve at sensors, by the laws of what the store states (codec/sensor_error.h). */
#ifndef LAMBERT_VERBS_SENSOR_OWN_ERROR_H
#define LAMBERT_VERBS_SENSOR_OWN_ERROR_H

#include "solver/operator/stated/stated_errors.h"
#include "solver/verbs/light_options.h"
#include "solver/verbs/solve_sensors.h"

/* Answers of more vectors than these, as the hours of a year are, state no error: each asks for the light of
 * all elements once more. */
enum { SENSOR_ERROR_VECTORS = 64 };

/* Sets the headline of out, that of all sets chosen together, and c->stated by set, of a batch the largest of
 * its vectors; out has the error of the store (codec stated_notes.h). Where the store states no errors of
 * the light, the headline says so. Errors: LAM_ERR_MEMORY, LAM_ERR_INTERNAL. */
lam_status sensor_error_take(const stated_errors *stated, const error_scene *scene, const lit_store *lit,
                             sensor_choice *c, solution *out, lam_error *error);

#endif
