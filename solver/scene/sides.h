/* Sides of faces: which faces hang together, and how each must lie to agree with its neighbours. */
#ifndef LAMBERT_SCENE_SIDES_H
#define LAMBERT_SCENE_SIDES_H

#include "solver/scene/mesh.h"

#include <stdbool.h>

/* Faces that hang together by edges that just two faces share. */
typedef struct mesh_sides {
    uint32_t *patch; /* [n], numbered from 0 by their first faces */
    bool *turned; /* [n]: with these turned, neighbours run along their edge in opposite ways. Of the two ways
                     to turn a patch, the one that turns less area. Where neighbours cannot agree (a Moebius
                     strip), some edge is left out. */
    size_t n_patches;
} mesh_sides;

/* Vertices closer than a millionth of the scene are one. Cost: O(n log n). The caller frees out with
 * mesh_sides_free. Errors: LAM_ERR_MEMORY. */
lam_status mesh_sides_find(const mesh *m, mesh_sides *out, lam_error *error);
void mesh_sides_free(mesh_sides *s);

/* Turns an element: what was its back is its front. */
void mesh_turn(mesh *m, size_t element);

#endif
