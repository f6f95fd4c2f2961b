/* The forecast of a precomputation: memory, time, room on the disk. */
#ifndef LAMBERT_PRECOMPUTE_FORECAST_H
#define LAMBERT_PRECOMPUTE_FORECAST_H

#include "solver/formfactor/factor_cost.h"
#include "solver/formfactor/recipe.h"
#include "solver/formfactor/scratch.h"
#include "solver/linalg/panel.h"
#include "solver/method/method.h"

#include <stdint.h>

typedef struct forecast {
    size_t n, n_channels;
    size_t n_groups;             /* of the scene; 0: none is judged as a whole */
    size_t n_own_channels;       /* whose reflectances no earlier one has; 0: all */
    size_t n_planes;             /* of the tree of clusters; 0: not known */
    size_t sky_tiles;            /* 0: no sky */
    recipe recipe, judge_recipe; /* of the form factors and of the judge's samples */
    factor_cost cost;            /* of recipe, where a sample of its pairs was taken; else 0 */
    size_t probes;               /* at most; 0: no independent samples */
    size_t probes_least;         /* 0: all */
    bool from_store;             /* form factors are there already */
    bool scratch;                /* rows go to a scratch folder as they are found */
    bool large;                  /* and whole samples lie there, as memory is too small for them */
    bool keep;                   /* the store keeps the form factors */
    bool streamed;               /* the method asks for rows one after the other; none are held */
    size_t emitters;             /* 0: none, or not read yet */
    const build_method *method;  /* NULL: no operator is built */
    const build_options *build;  /* its options */
    panel_precision precision;   /* of the stored operator */
} forecast;

/* Bytes at the peak; an upper bound for the form factors, an estimate for the rest. */
double forecast_bytes(const forecast *f);

/* LAM_ERR_MEMORY when that passes limit; the message names the option that would make it fit. */
lam_status forecast_check(const forecast *f, double limit, lam_error *error);

/* Processor seconds of a ray, on no machine in particular. */
static const double forecast_ray_seconds = 3.3e-7;

/* The pace of this machine, as short trials have it (machine_pace.h, ray_trial). */
typedef struct forecast_rates {
    double ray_seconds; /* processor seconds of a ray in this scene, or in any where rays do little */
    double slowness;    /* over the machine that the constants are of */
    double processors;  /* that the process gets */
} forecast_rates;

/* Processor seconds of the stages: of the form factors and of the judge's own samples from a sample of their
 * work, or from the cost of a ray; of the operator, 0 where its method does not tell, and of the judge's
 * solves from constants. */
typedef struct forecast_times {
    double form_factors, operate, judge, solves;
} forecast_times;
forecast_times forecast_seconds(const forecast *f, const forecast_rates *rates);

/* Seconds of a clock on the wall. */
double forecast_wall_seconds(double processor_seconds, const forecast_rates *rates);

/* The single elements, between probes_least and probes, that take no longer than the form factors, by what is
 * counted of both: no clock is read, so that the same scene has the same probes on every machine. */
size_t forecast_probes(const forecast *f);

/* Bytes of one tile of a sky, of the judge's two samples, of the operator in the store. */
double forecast_tile_bytes(double n);
double forecast_reference_bytes(const forecast *f);
double forecast_operator_bytes(const forecast *f);

/* Bytes of the store and of the scratch folder: upper bounds for form factors, an estimate for the operator.
 */
double forecast_store_bytes(const forecast *f);
double forecast_scratch_bytes(const forecast *f);

/* LAM_ERR_IO when the disks cannot hold that; the message names the option that would make it fit. scratch
 * may be NULL. Rows that an earlier run has left there count as free. */
lam_status forecast_check_disk(const forecast *f, const char *output, const scratch *rows,
                               const char *scratch_folder, lam_error *error);

/* "812K", "8120M", "24.1G": at least three digits above 100K, so that two figures close to each other differ;
 * rounded up, or down. */
void forecast_format_room(double bytes, bool up, char text[32]);

/* "812M", "2.4G" */
void forecast_format_bytes(double bytes, char text[32]);

/* Bytes that are free: MemAvailable of /proc/meminfo, less where a control group allows less; 0 when unknown.
 */
uint64_t memory_available(void);

#endif
