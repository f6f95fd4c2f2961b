/* How much memory a precomputation will take, told before it begins. */
#ifndef LAMBERT_SOLVER_FORECAST_H
#define LAMBERT_SOLVER_FORECAST_H

#include "solver/formfactor/recipe.h"

#include <stdint.h>

typedef struct forecast {
    size_t n, n_channels;
    size_t sky_tiles;            /* 0: no sky */
    recipe recipe, judge_recipe; /* of the form factors and of the judge's samples */
    size_t probes;               /* 0: no independent samples */
    bool exact;                  /* the whole inverse is built */
    size_t rank;                 /* 0: not known yet */
} forecast;

/* Bytes at the peak; an upper bound for the form factors, an estimate for the rest. */
double forecast_bytes(const forecast *f);

/* LAM_ERR_MEMORY when that passes limit; the message names the option that would make it fit. */
lam_status forecast_check(const forecast *f, double limit, lam_error *error);

/* Bytes that are free: MemAvailable of /proc/meminfo, less where a control group allows less; 0 when unknown.
 */
uint64_t memory_available(void);

#endif
