/* The light of one vector of a lambert solve, as its error is told by: what elements emit, the sky,
 * luminaires, the sun, and what elements get of these directly; of a store of few emitters as their weights
 * tell it. */
#ifndef LAMBERT_VERBS_OWN_LIGHT_H
#define LAMBERT_VERBS_OWN_LIGHT_H

#include "solver/operator/stated/answer_error.h"
#include "solver/verbs/light_options.h"

typedef struct own_light {
    const lit_store *lit;
    const error_scene *scene;
    size_t n_tiles; /* of the sky that shines; 0: none */
    float *E, *H0;  /* [C][n], mesh order; H0 with luminaires and the sun */
    float *L;       /* [C][n_tiles]; NULL: no sky */
    float *L_sent; /* of a sun in a tile that is sent on as the light of that, and no part of L; NULL: none */
    float *sent;   /* [C][n], the part of H0 that elements send on, of luminaires and the sun, and [2][n] of
                      work; NULL: neither shines */
    float *lamps;  /* [C][n], direct light of luminaires; NULL: none shine */
    size_t vector; /* that was taken */
    float *sun, *work;
    double lost2; /* of error_answer */
} own_light;

/* Errors: LAM_ERR_MEMORY. */
lam_status own_light_make(const lit_store *lit, const error_scene *scene, own_light *out, lam_error *error);
void own_light_free(own_light *l);

/* Takes vector v. An operator takes the direct light of luminaires as what elements send on. An exact sun has
 * no error of its direct light; an operator takes it as what elements send
 * on, and one of few emitters sends on the light of its tile in its place: what is lost by that is the power
 * of the difference. Errors: LAM_ERR_MEMORY, and those of the weights of emitters. */
lam_status own_light_take(own_light *l, size_t v, lam_error *error);

/* Fills the light of an answer: E, H0, L and their sizes by the powers of tiles. */
void own_light_put(own_light *l, const error_by_group *by, error_answer *of);

#endif
