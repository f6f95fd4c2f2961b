/* Faces of a mesh joined into larger ones, before it is divided anew. */
#ifndef LAMBERT_SCENE_FACET_FACE_JOIN_H
#define LAMBERT_SCENE_FACET_FACE_JOIN_H

#include "solver/scene/mesh.h"

/* The faces of a mesh before they were joined, by what each became a part of. Zero: none were. */
typedef struct faces_before {
    size_t n; /* of these faces */
    double (*vertices)[3];
    uint32_t (*elements)[4]; /* [n] */
    uint32_t *face;          /* [n], numbers in the scene file */
    size_t n_joined;
    uint32_t *start, *order; /* [n_joined + 1], into order [n]: faces by what they are joined to */
} faces_before;

void faces_before_free(faces_before *b);

/* Joins faces of one group and one material, without images, that lie in one plane and share a whole edge
 * into larger ones of 3 or 4 corners, in place; the others keep their order. The mesh's numbers of faces are
 * those of its own faces then, before those of the scene file, until faces_part; before NULL: they are not
 * known from then on. Cost: O(n log n). Errors: LAM_ERR_ARGUMENT for a two-sided mesh, LAM_ERR_MEMORY. */
lam_status faces_join(mesh *m, faces_before *before, lam_error *error);

/* Gives the elements of a mesh, which joined faces were divided into, the faces of the scene file that they
 * are parts of: one where all but a millionth of it is of that one, else several, with the areas that they
 * have in common. before zero: nothing is done. Cost: O(n log n) for faces of about one size. Errors:
 * LAM_ERR_MEMORY. */
lam_status faces_part(mesh *m, const faces_before *before, lam_error *error);

#endif
