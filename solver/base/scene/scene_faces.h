/* The faces of the scene file that elements are parts of (store/FORMAT.md, /mesh). Both programs read them.
 * Faces are counted from 0 in the file's order. */
#ifndef LAMBERT_BASE_SCENE_FACES_H
#define LAMBERT_BASE_SCENE_FACES_H

#include "store/store.h"

/* The face of an element that is a part of none, or of several. */
#define SCENE_FACE_NONE UINT32_MAX

/* The area that an element, which is a part of several faces, has in common with one of them. */
typedef struct scene_face_part {
    uint32_t element, face;
    double area; /* m^2 */
} scene_face_part;

/* Zero where the faces are not known, as in stores of earlier versions. */
typedef struct scene_faces {
    size_t n_faces; /* of the file */
    uint32_t *of;   /* [n], of a back the face of its front; or SCENE_FACE_NONE. NULL: not known */
    size_t n_parts; /* of fronts that are parts of several faces, in order of element and face */
    scene_face_part *parts;
} scene_faces;

void scene_faces_free(scene_faces *f);

/* areas [n_faces]: m^2 of the elements of each face, of which the first n_fronts are fronts; area [n] is that
 * of elements. A face without an element has 0. O(n + n_faces). */
void scene_faces_sum(const scene_faces *f, size_t n_fronts, const double *area, double *areas);

/* Writes the arrays of n elements, or nothing where they are not known. Errors: LAM_ERR_MEMORY, LAM_ERR_IO.
 */
lam_status scene_faces_save(const scene_faces *f, size_t n, size_t n_fronts, const double *area, store *s,
                            lam_error *error);

/* Reads and checks them; *out is zero where a store has none. Errors: LAM_ERR_FORMAT, LAM_ERR_MEMORY. */
lam_status scene_faces_load(store *s, size_t n, size_t n_fronts, scene_faces *out, lam_error *error);

/* The number of faces of a store, of which nothing else is read; 0: it is not known. */
lam_status scene_faces_count(store *s, size_t *n_faces, lam_error *error);

#endif
