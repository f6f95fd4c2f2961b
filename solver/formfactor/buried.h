/* Elements that lie between a body and the face that it stands on. */
#ifndef LAMBERT_FORMFACTOR_BURIED_H
#define LAMBERT_FORMFACTOR_BURIED_H

#include "solver/scene/mesh.h"

/* Marks elements in m->buried, or sets that to NULL where there is none; *n is their number. Faces of one
 * plane that look to opposite sides are a sheet. Where one of them is the side of a body, the other one lies
 * in it: the part of a floor below a box sees the insides of the box, and the underside of the box what is
 * below the floor. An element is buried that faces of the other side cover, where all that it sees is the
 * inside of a body, or where it sees no front and all that lies behind it is. Neither the leaves of a tree
 * nor the walls of a house of sheets are: these see fronts or the sky from both sides. Backs that were made
 * for fronts do not count. Cost: O(n log n), and 64 rays for each element that is covered so. Errors:
 * LAM_ERR_MEMORY, LAM_ERR_INTERNAL. */
lam_status buried_find(mesh *m, size_t *n, lam_error *error);

#endif
