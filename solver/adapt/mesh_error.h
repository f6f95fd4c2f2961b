/* The error that constants on elements leave, whatever an operator is worth: the part of B - E that varies
 * inside elements, as a share of |B - E|, area-weighted, channels stacked. Must not know how answers were
 * found. */
#ifndef LAMBERT_ADAPT_MESH_ERROR_H
#define LAMBERT_ADAPT_MESH_ERROR_H

#include "solver/adapt/gather.h"
#include "solver/adapt/look_plan.h"

/* By light and group, [n_lights][n_groups], means by area, channels summed: the variance of rho H inside
 * elements, which its noise may make negative, the standard error of that, and (B - E)^2. All are 0 of groups
 * that were not looked at. */
typedef struct mesh_error_groups {
    double *variance, *noise, *light2;
    size_t fewer; /* looks are the whole numbers of these shares of them; 0: all */
} mesh_error_groups;

/* Light that comes to points directly from sources that are no elements: at fills H [n_points][n_lights C]
 * for points of the elements given, or fails. */
typedef struct mesh_direct {
    lam_status (*at)(void *context, size_t n_points, const double (*points)[3], const uint32_t *elements,
                     double *H, lam_error *error);
    void *context;
} mesh_direct;

/* error[n_lights] of the answers B [n_lights][C][n] to the emissions E, the first of which comes from lamps
 * where `lamps` says so, or to skies or direct light (NULL: none), whose emission is 0; 0 for a light of
 * which nothing bounces. groups: NULL, or what is filled by group. The variance over an element of B(x) - E =
 * rho H(x) comes from gathering at one random point in each quarter; the product of two independent halves of
 * each estimate has no noise on average. The same for any number of threads. Cost: 768 rays and segments for
 * each element that is looked at. Errors: LAM_ERR_MEMORY, LAM_ERR_INTERNAL, LAM_ERR_CANCELLED. */
lam_status mesh_error(const mesh *m, size_t n_lights, const float *E, const float *B, bool lamps,
                      const gather_sky *sky, const mesh_direct *direct, uint64_t seed, const progress *p,
                      double *error_of_light, const mesh_error_groups *groups, lam_error *error);

#endif
