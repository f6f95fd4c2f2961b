/* Statistics of the values of groups of elements: mean = sum A x / sum A, sum = sum A x, min, max, uniformity
 * = min / mean, variance = sum A (x - mean)^2 / sum A, share = sum A [x >= limit] / sum A. Buried elements,
 * which no light reaches, have no part in them. */
#ifndef LAMBERT_OPERATOR_GROUPS_GROUP_STATISTICS_H
#define LAMBERT_OPERATOR_GROUPS_GROUP_STATISTICS_H

#include "solver/operator/groups/groups.h"

typedef enum reduce_statistic {
    REDUCE_MEAN,
    REDUCE_SUM,
    REDUCE_MIN,
    REDUCE_MAX,
    REDUCE_UNIFORMITY,
    REDUCE_VARIANCE,
    REDUCE_COUNT,
    REDUCE_SHARE = REDUCE_COUNT, /* of a limit, which those before need not */
    REDUCE_UGR                   /* of each eye of a set of sensors */
} reduce_statistic;

/* A name, and the groups of the scene that it means (group_index_find). */
typedef struct reduce_name {
    size_t text; /* in a request: its offset in texts; it ends with a NUL */
    const uint32_t *groups;
    size_t n_groups;
} reduce_name;

/* Values to reduce, in single or in double precision. */
typedef struct reduce_values {
    const float *floats;
    const double *doubles;
    bool whole; /* of every element in mesh order; else of those of some groups, group by group */
} reduce_values;

/* One vector and channel of values: those of group g stand from begin[g] on; where begin is NULL, they are in
 * mesh order. */
typedef struct value_row {
    const uint32_t *begin;
    reduce_values x;
    size_t first;
} value_row;

/* The bit of a statistic, by its name without REDUCE_. */
#define REDUCE_BIT(name) (1u << REDUCE_##name)

/* The statistics asked (REDUCE_BIT) of the elements of some groups; area [n] in mesh order, or NULL for 1 of
 * each. NaN where one has no value, of no area or a mean of 0, and where it is not asked. Cost: a pass over
 * the values, one for sums and one for the variance, where they are needed. */
void group_statistics(size_t n_named, const uint32_t *named, const group_index *groups, const double *area,
                      const value_row *row, unsigned asked, double out[REDUCE_COUNT]);

/* Every statistic of x [n] in mesh order. */
void reduce_groups(size_t n_named, const uint32_t *named, const group_index *groups, const double *area,
                   reduce_values x, double out[REDUCE_COUNT]);

/* The share of their area that has at least the limit; NaN without area. */
double group_share(size_t n_named, const uint32_t *named, const group_index *groups, const double *area,
                   const value_row *row, double limit);

#endif
