/* Sets of probes among the sensors that `lambert solve` answers at: nine coefficients of the radiance at
 * each, in a table, as JSON or as NPY. */
#ifndef LAMBERT_VERBS_SOLVE_PROBES_H
#define LAMBERT_VERBS_SOLVE_PROBES_H

#include "solver/verbs/solve_sensors.h"

#include <jansson.h>

bool solve_probes_are(const lam_sensors *all, size_t set);

/* Refuses what coefficients cannot be: limits of a year (linear: there are none), lines of CSV, and an array
 * beside sensors that are no probes. path: of the output, or NULL. Errors: LAM_ERR_ARGUMENT. */
lam_status solve_probes_check(const sensor_choice *c, bool linear, const char *path, lam_error *error);

/* {"name", "axes": "scene" or "y-up", "quantity": "radiance", "unit", "at": [[x, y, z], ...] in these axes,
 * "coefficients": [probes][9][channels]}, of a batch an array of these; null of a probe without a value. */
json_t *solve_probes_json(const sensor_choice *c, const solution *s, size_t set);

/* A line of the table for each vector and channel: the mean radiance of all directions. */
void solve_probes_print(const sensor_choice *c, const solution *s, size_t set);

/* [vectors of a batch][probes][9][channels], NaN of a probe without a value. */
lam_status solve_probes_npy(const sensor_choice *c, const solution *s, FILE *stream, lam_error *error);

#endif
