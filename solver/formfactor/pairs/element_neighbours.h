/* The elements beside each element of a mesh. Knows no light. */
#ifndef LAMBERT_FORMFACTOR_PAIRS_ELEMENT_NEIGHBOURS_H
#define LAMBERT_FORMFACTOR_PAIRS_ELEMENT_NEIGHBOURS_H

#include "solver/scene/mesh.h"

enum { NEIGHBOURS_MOST = 12 };

/* neighbours, [n]: the elements that share both vertices of an edge, then UINT32_MAX. Cost: O(n log n).
 * Errors: LAM_ERR_MEMORY. */
lam_status element_neighbours_find(const mesh *m, uint32_t (*neighbours)[NEIGHBOURS_MOST], lam_error *error);

#endif
