/* Which elements share an edge. */
#ifndef LAMBERT_FORMFACTOR_PAIRS_NEIGHBOURS_H
#define LAMBERT_FORMFACTOR_PAIRS_NEIGHBOURS_H

#include "solver/scene/mesh.h"

enum { NEIGHBOURS_MOST = 12 };

/* neighbours is [n]: the elements that have two vertices of an edge in common, UINT32_MAX where there are no
 * more. */
lam_status neighbours_find(const mesh *m, uint32_t (*neighbours)[NEIGHBOURS_MOST], lam_error *error);

#endif
