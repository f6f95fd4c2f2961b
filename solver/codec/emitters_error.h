/* The errors of mixtures of the emitters of a store, from the covariance that it states (/error/emitters). */
#ifndef LAMBERT_CODEC_EMITTERS_ERROR_H
#define LAMBERT_CODEC_EMITTERS_ERROR_H

#include "solver/codec/answer_error.h"

/* Zeroed: a store that states none. */
typedef struct emitters_error {
    size_t s;
    double *covariance; /* [s][s], (W/m^2)^2 m^2: w' K w is the mean of |B~ - B|^2 of weights w */
} emitters_error;

void emitters_error_free(emitters_error *e);

/* Errors: LAM_ERR_FORMAT, LAM_ERR_MEMORY. *out is zeroed where the store has no such figures. */
lam_status emitters_error_read(store *s, size_t n_emitters, emitters_error *out, lam_error *error);

/* The error of an answer for all elements to weights W [C][s]: of each emitter the largest over channels. The
 * size of the emission in `of` is not used. O(C n + s^2). */
answer_error emitters_error_of(const emitters_error *e, const error_scene *scene, const error_answer *of,
                               const float *W);

#endif
