/* Openings of a scene: the regions that the faces of a plane leave open between them, and those that edges of
 * one face each surround. They are found in faces, whose edges need not match: T-junctions and seams are no
 * edges of an opening. A region may be a window, a door, the open side of a box or a notch of a roof: rays
 * have to tell these apart. */
#ifndef LAMBERT_SCENE_FACET_FACE_OPENINGS_H
#define LAMBERT_SCENE_FACET_FACE_OPENINGS_H

#include "solver/scene/facet/plane_rectangle.h"
#include "solver/scene/mesh.h"

/* Openings of a scene that are kept: the largest. */
enum { FACE_OPENINGS_MOST = 4096 };

/* The points corner + x edge[0] + y edge[1] with x and y from 0 to 1, or, of a triangle, with x + y up to 1.
 * The edges of all patches of an opening turn the same way. */
typedef struct plane_patch {
    double corner[3], edge[2][3]; /* metres, in the coordinates of the scene */
    bool triangle;
    uint32_t opening;
} plane_patch;

typedef struct face_openings {
    size_t n, n_patches;
    plane_patch *patches; /* [n_patches], by opening; an opening that fills most of a rectangle is one */
    size_t n_left;        /* openings that are not kept: smaller than all others */
    bool given;           /* by the user: whatever stands before them, they count */
} face_openings;

/* The openings of a mesh, the largest first:
 * - regions with an edge of a plane's faces on their rim that no face of the plane covers, less islands;
 * - what a straight line closes of the outside of such a plane: a door down to a floor that has no edge
 * there;
 * - plane loops of edges of one face each, none of whose faces lies in their plane: a missing ceiling.
 * Corners and edges match to a hundred-thousandth of the diagonal of the scene, as quads are plane
 * (plane_flatness). Regions narrower than `narrow` metres (2 area / perimeter) are left out. Freed by
 * face_openings_free. Cost: O(n log n) but for planes with very many outlines. Errors: LAM_ERR_MEMORY. */
lam_status face_openings_find(const mesh *m, double narrow, face_openings *out, lam_error *error);

/* Adds a rectangle as an opening that is given. Errors: LAM_ERR_MEMORY, with nothing changed. */
lam_status face_openings_give(face_openings *o, const plane_rectangle *r, lam_error *error);
void face_openings_free(face_openings *o);

#endif
