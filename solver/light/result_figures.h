/* Figures over a group of elements: what is left when a vector is too much. */
#ifndef LAMBERT_LIGHT_RESULT_FIGURES_H
#define LAMBERT_LIGHT_RESULT_FIGURES_H

#include "solver/scene/mesh.h"

typedef enum reduce_statistic {
    REDUCE_MEAN, /* sum A x / sum A */
    REDUCE_SUM,  /* sum A x */
    REDUCE_MIN,
    REDUCE_MAX,
    REDUCE_UNIFORMITY, /* min / mean */
    REDUCE_VARIANCE,   /* sum A (x - mean)^2 / sum A */
    REDUCE_COUNT
} reduce_statistic;

typedef struct reduction {
    char group[128];
    bool wanted[REDUCE_COUNT];
    bool *inside; /* [n_groups]: which groups the name means */
} reduction;

/* The contract's word for a statistic. */
const char *reduce_name(reduce_statistic statistic);

/* Reads GROUP=mean or GROUP=mean,max; freed by reduce_free. LAM_ERR_ARGUMENT names the item. */
lam_status reduce_parse(const char *item, reduction *out, lam_error *error);

/* Finds the groups of a parsed reduction in a mesh. LAM_ERR_ARGUMENT when there are none. */
lam_status reduce_bind(reduction *r, const mesh *m, lam_error *error);

void reduce_free(reduction *r);

/* Every statistic of x, [n], over the elements of the groups marked inside; NaN where it has no value. */
void reduce_compute(const mesh *m, const bool *inside, const float *x, double out[REDUCE_COUNT]);
void reduce_compute_double(const mesh *m, const bool *inside, const double *x, double out[REDUCE_COUNT]);

#endif
