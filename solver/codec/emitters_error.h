/* The errors of mixtures of the emitters of a store, from the covariances that it states (/error/emitters).
 */
#ifndef LAMBERT_CODEC_EMITTERS_ERROR_H
#define LAMBERT_CODEC_EMITTERS_ERROR_H

#include "solver/codec/answer_error.h"

/* Weights w have the mean squared error w' K w of B, channels stacked, of all elements (K, with areas), of
 * those of a group (K_g), and of the mean of a group (M_g); of a group that reflects nothing, which has no
 * part in K unless all are so, of H. Zeroed: a store that states none. */
typedef struct emitters_error {
    size_t s, n_groups;
    double *covariance; /* [s][s] */
    double *of_groups;  /* [n_groups][s][s]; NULL: the store does not have them */
    double *of_means;   /* the same, with it */
    /* Of groups, with of_groups: areas, mean reflectances [C][n_groups], and the mean irradiance that
     * emitters outside the mesh give directly, [n_groups][s] of 1 W/m^2. */
    double *area, *reflectance, *direct;
    double *exitance;  /* [C], W/m^2 of weight 1 */
    reflecting *black; /* [n_groups], with of_groups: how errors of B and H go together */
    reflecting whole;  /* the same of all elements */
    uint32_t *group;   /* [n] */
} emitters_error;

/* The light of emitters outside the mesh, as the operator has it. */
typedef struct emitters_light {
    size_t s;
    const float *direct, *exitance; /* [s][n], [C]; NULL: there are none */
} emitters_light;

void emitters_error_free(emitters_error *e);

/* Errors: LAM_ERR_FORMAT, LAM_ERR_MEMORY. *out is zeroed where the store has no such figures, or the emitters
 * are elements or tiles. O(n s). */
lam_status emitters_error_read(store *s, const error_scene *scene, const emitters_light *light,
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

/* The error of an answer to a mixture. The size of the emission in `of` is not used; of elements that are
 * selected, those of a group have the error that its elements have on average. O(C count + s^2), the second
 * for each group that is first asked for. */
answer_error emitters_error_of(const emitters_error *e, const error_scene *scene, const error_answer *of,
                               emitters_mix *mix);

/* The error of one name of a reduction, by the mean [C] of the quantity over it. Errors of the means of
 * several groups add up. O(C s) for each group of the name, and s^2 as above. */
name_error emitters_error_of_name(const emitters_error *e, size_t n_channels, lam_quantity quantity,
                                  const reduce_name *name, emitters_mix *mix, const double *mean);

#endif
