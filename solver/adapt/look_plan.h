/* The elements at which the light inside elements is looked at, shared among groups by their areas, so that
 * neither large elements nor bright ones are left out. */
#ifndef LAMBERT_ADAPT_LOOK_PLAN_H
#define LAMBERT_ADAPT_LOOK_PLAN_H

#include "solver/scene/mesh.h"

/* Elements that are looked at: as many as there are, within the first two, shared among groups by their
 * areas, but LOOKS_OF_GROUP in each group at least; of many groups fewer, so that these are no more than
 * LOOKS_OF_GROUPS together. */
enum { LOOKS_LEAST = 64, LOOKS_MOST = 1024, LOOKS_OF_GROUP = 16, LOOKS_OF_GROUPS = 4096 };

/* The elements of each group, and the looks at them. */
typedef struct look_plan {
    uint32_t *start, *members; /* [n_groups + 1], [n] */
    double *weight;            /* [n], of members[k]: it is looked at as often as this says */
    size_t *first;             /* [n_groups + 1]: the looks of group g are first[g] ... first[g + 1] - 1 */
    uint32_t *chosen;          /* of each look */
    double *area;              /* of each look: the area that it stands for */
    double *light2;            /* [n_lights][n_groups], sum A (B - E)^2 */
    double *group_area;        /* [n_groups] */
} look_plan;

/* Plans looks for the answers B [n_lights][C][n] to the emissions E, of which there may be none. fewer: looks
 * are the whole numbers of these shares of them; 0: all. Freed by look_plan_free, also after a failure.
 * Errors: LAM_ERR_MEMORY, LAM_ERR_INTERNAL. */
lam_status look_plan_make(const mesh *m, size_t n_lights, const float *E, const float *B, size_t fewer,
                          look_plan *l, lam_error *error);
void look_plan_free(look_plan *l);

/* The sum over a group of what its looks have found, x_k = a_k seen_k with seen [looks][n_values], and its
 * standard error. */
typedef struct look_sum {
    double sum, noise;
} look_sum;
look_sum look_plan_sum(const look_plan *l, size_t n_values, const double *seen, size_t value, size_t group);

#endif
