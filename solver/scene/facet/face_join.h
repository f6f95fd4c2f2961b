/* Faces of a mesh joined into larger ones, before it is divided anew. */
#ifndef LAMBERT_SCENE_FACET_FACE_JOIN_H
#define LAMBERT_SCENE_FACET_FACE_JOIN_H

#include "solver/scene/mesh.h"

/* Joins faces of one group and one material, without images, that lie in one plane and share a whole edge
 * into larger ones of 3 or 4 corners, in place; the others keep their order. Cost: O(n log n). Errors:
 * LAM_ERR_ARGUMENT for a two-sided mesh, LAM_ERR_MEMORY. */
lam_status faces_join(mesh *m, lam_error *error);

#endif
