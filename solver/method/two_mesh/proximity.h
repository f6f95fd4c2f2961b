/* Assignment of elements to patches by proximity (Fernández et al. 2011, section 3.2). */
#ifndef LAMBERT_METHOD_TWO_MESH_PROXIMITY_H
#define LAMBERT_METHOD_TWO_MESH_PROXIMITY_H

#include "solver/method/method.h"

/* Moves elements to the patch with the nearest centroid among those that face the same way (mean normal
 * within 60 degrees; an element that none faces with stays), the first of equal ones; the element of each
 * patch that is nearest to its centroid stays. element and begin as in coarse_mesh.h, changed in place;
 * within a patch elements come out in mesh order. Cost: O(n k). */
lam_status assign_by_proximity(const build_problem *problem, size_t k, uint32_t *element, uint64_t *begin,
                               lam_error *error);

#endif
