/* The errors of mixtures of the emitters of a store, from the covariances that it states. */
#ifndef LAMBERT_OPERATOR_STATED_EMITTERS_LAW_H
#define LAMBERT_OPERATOR_STATED_EMITTERS_LAW_H

#include "solver/operator/stated/error_law.h"

/* Covariances with what mixtures need of the mesh and of the operator. Zeroed: a store that states none. */
typedef struct emitters_error {
    emitter_figures figures;
    /* Groups have these with figures.of_groups: areas, mean reflectances [C][n_groups], and the mean
     * irradiance that emitters outside the mesh give directly, [n_groups][s] of 1 W/m^2. */
    double *area, *reflectance, *direct;
    double *exitance;  /* [C], W/m^2 of weight 1 */
    reflecting *black; /* [n_groups], with figures.of_groups: how errors of B and H go together */
    reflecting whole;  /* the same of all elements */
    uint32_t *group;   /* [n] */
} emitters_error;

void emitters_error_free(emitters_error *e);

/* The emitters of op that stores may state covariances of: those outside the mesh; 0: it has none. */
size_t emitters_error_count(const lam_operator *op);

/* Takes over those of figures that were loaded for so many emitters. *out is zeroed where there are none.
 * Errors: LAM_ERR_MEMORY. O(n s). */
lam_status emitters_error_make(const error_scene *scene, const lam_operator *op, stated_figures *from,
                               emitters_error *out, lam_error *error);

/* True if the error of an answer for some elements or of names can be told, too. */
bool emitters_error_knows_groups(const emitters_error *e);

/* One mixture: its weights, of each emitter the largest over channels, and its squared errors. */
typedef struct emitters_mix {
    const float *W;             /* [C][s], the caller's */
    double *weight;             /* [s], and in one block with it */
    double *of_group, *of_mean; /* [n_groups]: of its elements, and of its mean; negative: not found yet */
    double emitters;            /* their effective number, (sum w)^2 / sum w^2 */
} emitters_mix;

/* O(s). False when memory is short. Freed by emitters_mix_free. */
bool emitters_mix_create(const emitters_error *e, size_t n_channels, const float *W, emitters_mix *out);
void emitters_mix_free(emitters_mix *m);

/* The squared errors of a group into of_group and of_mean, found when they are first asked for: O(s^2). */
void emitters_mix_find(const emitters_error *e, size_t g, emitters_mix *m);

/* The squared error of all elements: by groups where these are kept apart. */
double emitters_mix_all2(const emitters_error *e, lam_quantity quantity, emitters_mix *m);

#endif
