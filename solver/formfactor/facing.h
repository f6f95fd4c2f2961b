/* Sides of faces by rays: where light meets backs and is lost, and to which side a face should look. */
#ifndef LAMBERT_FORMFACTOR_FACING_H
#define LAMBERT_FORMFACTOR_FACING_H

#include "solver/scene/mesh.h"

/* Where the light of all fronts, spread evenly by area, meets backs. */
typedef struct facing_survey {
    double share;         /* of the light that does, with a standard error of at most .002 */
    size_t faces;         /* elements whose backs were met: a lower bound */
    double *group_shares; /* [n_groups], their sum is share */
} facing_survey;

/* Casts 65,536 rays. The caller frees out with facing_survey_free. Errors: LAM_ERR_MEMORY,
 * LAM_ERR_INTERNAL. */
lam_status facing_survey_make(const mesh *m, facing_survey *out, lam_error *error);
void facing_survey_free(facing_survey *s);

typedef struct facing_turned {
    size_t turned;    /* elements */
    size_t undecided; /* elements of patches whose side was not decided; neighbours agree nevertheless */
} facing_turned;

/* Turns elements of a mesh that is not two-sided, in place. Neighbours come to agree (mesh_sides_find), and
 * most of a patch's area stays as it is; then patch after patch, the largest first, comes to look to the side
 * from which more rays meet fronts of other patches and fewer their backs, until all do. So the larger part
 * of a scene must look the right way. Where no ray meets another patch (an empty room), or both sides see
 * alike, nothing is decided. Cost: 128 to 2,048 rays for each patch. Errors: LAM_ERR_MEMORY,
 * LAM_ERR_INTERNAL, LAM_ERR_CANCELLED. */
lam_status facing_orient(mesh *m, const progress *how, facing_turned *out, lam_error *error);

/* Turns all elements where the fronts of a scene see nothing, and its backs hardly anything but backs: a room
 * that was modelled from outside, which is *turned then. Casts 131,072 rays. Errors: LAM_ERR_MEMORY,
 * LAM_ERR_INTERNAL. */
lam_status facing_turn_inward(mesh *m, bool *turned, lam_error *error);

#endif
