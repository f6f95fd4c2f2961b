/* The error that constants on elements leave of the light of single elements, of all of them at once: the
 * form factors of points vary inside elements, whatever shines. */
#ifndef LAMBERT_ADAPT_MESH_SINGLE_H
#define LAMBERT_ADAPT_MESH_SINGLE_H

#include "solver/adapt/mesh_error.h"

/* By group, [1][n_groups], means by area: of the light H = F(x, j) that element j sends to a point x when it
 * emits 1 W/m^2,
 *     sum_j sum_c rho_c^2 var F(x, j) / A_j    and    sum_j sum_c rho_c^2 F(x, j)^2 / A_j,
 * that is, of lights of power 1 W each times A_j, so that small elements and large ones weigh about the same.
 * Only the first bounce is in it. A product of two independent halves of each estimate has no noise on
 * average. The same for any number of threads. Cost: 512 rays for each element that is looked at
 * (look_plan.h). Errors: LAM_ERR_MEMORY, LAM_ERR_INTERNAL, LAM_ERR_CANCELLED. */
lam_status mesh_single(const mesh *m, uint64_t seed, const progress *p, const mesh_error_groups *groups,
                       lam_error *error);

#endif
