/* Answers of lambert solve by face of the scene file. */
#ifndef LAMBERT_VERBS_SOLVE_FACES_H
#define LAMBERT_VERBS_SOLVE_FACES_H

#include "solver/light/emission_refine.h"
#include "solver/output/output.h"

/* Takes the faces of the mesh of the store at path into an index, freed by face_index_free. Errors:
 * LAM_ERR_ARGUMENT (the store does not know them), LAM_ERR_MEMORY. */
lam_status solve_faces_find(const char *path, mesh *m, face_index *out, lam_error *error);

/* Puts the means of faces in the place of the values of elements, *values or refined, and in s; certificates
 * rise by their rounding. Errors: LAM_ERR_MEMORY. */
lam_status solve_faces_take(const face_index *faces, float **values, refined_light *refined, solution *s,
                            lam_error *error);

#endif
