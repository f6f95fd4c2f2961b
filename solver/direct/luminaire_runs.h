/* One luminaire after another with the scene that it sees: those that ignore the same groups are in a row, so
 * that one scene without these groups is in memory at a time. */
#ifndef LAMBERT_DIRECT_LUMINAIRE_RUNS_H
#define LAMBERT_DIRECT_LUMINAIRE_RUNS_H

#include "solver/direct/luminaire_sight.h"

typedef struct luminaire_run {
    size_t step, row, luminaire; /* in this order; among those that are wanted; in the list */
    placed_source source;
    const luminaire_sight *sight;
    const ignored_groups *ignored;
    double moved[3]; /* of places of the opening, before segments end there */
} luminaire_run;

typedef lam_status luminaire_runner(void *context, const luminaire_run *run, lam_error *error);

/* Calls the runner for each luminaire that is wanted; wanted NULL: for all. Stops at the first that fails. */
lam_status luminaire_runs(const mesh *m, const placed_luminaires *p, size_t n_wanted, const size_t *wanted,
                          luminaire_runner *runner, void *context, lam_error *error);

#endif
