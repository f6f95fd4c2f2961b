/* The inside of lam_scene, for the files of this folder. */
#ifndef LAMBERT_OPERATOR_SCENE_LAM_SCENE_H
#define LAMBERT_OPERATOR_SCENE_LAM_SCENE_H

#include "solver/operator/groups/adjoint_row.h"
#include "solver/operator/groups/groups.h"
#include "solver/operator/limiter.h"
#include "solver/operator/operator.h"
#include "solver/operator/stated/stated_errors.h"
#include "store/status.h"

struct lam_scene {
    size_t n, n_channels;
    lam_operator *op;
    lam_limiter limiter; /* it borrows groups and areas */
    lam_sky *sky;
    lam_luminaires *luminaires;
    group_index groups; /* measured */
    const double *area; /* [n] */
    store_view areas;   /* they hold it */
    float *normal, *centre;
    const char *lights;
    stated_errors errors;
    error_scene about;   /* views, for errors */
    linear_scene linear; /* views, for rows */
    emitter_weights *weights;
};

/* The light of one vector, expanded: of a store of few emitters all by its weights W. */
typedef struct full_light {
    float *E;       /* [C][n] */
    float *H0;      /* [C][n]; NULL: none */
    float *W;       /* [C][s]; NULL: the store answers any emission */
    const float *L; /* [C][m]; NULL: none */
    const float *D; /* [C][k], also those in W where emission is wanted; NULL: none */
} full_light;

/* False with LAM_ERR_ARGUMENT for parts that the store has not, and groups that are not below their number.
 */
lam_status lam_light_check(const lam_scene *s, const lam_light *light, lam_error *error);

/* Floats of room for the light of a vector. */
size_t full_light_room(const lam_scene *s);

/* In room, of full_light_room floats, whose content is lost and which must outlive out. with_emission: E and
 * H0 are wanted of a store of few emitters, too. Errors: those of lam_light_check and lam_operator_weights.
 * O(C n), and that of direct light. */
lam_status full_light_make(const lam_scene *s, const lam_light *light, bool with_emission, float *room,
                           full_light *out, lam_error *error);

/* LAM_ERR_ARGUMENT unless all are below their number. */
lam_status lam_groups_check(const lam_scene *s, size_t n_groups, const uint32_t *groups, lam_error *error);

#endif
