/* The plane parts of a scene's groups. Knows no maps. */
#ifndef LAMBERT_LIGHTMAP_PLANE_PARTS_H
#define LAMBERT_LIGHTMAP_PLANE_PARTS_H

#include "solver/scene/mesh.h"

/* part [n elements]: the number of the part of each, counted from 0 by first elements. Elements of one group
 * are of one part where they share an edge in one plane, or are parts of one face of the scene file, with
 * their fronts to the same side. A part that is not plane as a whole is one for each element. Cost: O(n log
 * n). Errors: LAM_ERR_MEMORY. */
lam_status plane_parts_find(const mesh *m, uint32_t *part, size_t *n_parts, lam_error *error);

#endif
