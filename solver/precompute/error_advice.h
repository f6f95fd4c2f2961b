/* The one line that a precompute ends with where a stated error is large: which error, and the option that
 * would lower it. */
#ifndef LAMBERT_PRECOMPUTE_ERROR_ADVICE_H
#define LAMBERT_PRECOMPUTE_ERROR_ADVICE_H

#include "solver/formfactor/recipe.h"
#include "solver/method/judge/judge.h"

enum { ERROR_ADVICE_BYTES = 384 };

/* The indirect error of the scene's own lights and of random emission that a store has at most without a
 * warning, unless --epsilon asks for another one: .03. */
extern const double error_advice_most;

/* An error of light from the sky above it may be that of a window that was not found: .1. */
extern const double error_advice_sky_large;

/* The makings of a store whose errors were measured. */
typedef struct error_advice_input {
    const error_report *errors;
    recipe recipe;            /* of the form factors */
    double asked;             /* the error of --epsilon that trials did not reach; 0: there were none */
    double group_asked;       /* that of --group-error; 0: it was not given */
    const worst_group *worst; /* as stated, and its name; may be NULL where group_asked is 0 */
    const char *worst_name;
    size_t trials_left;       /* as many may --trials be, where it was the limit, else 0 */
    const char *other_method; /* that follows --epsilon, where the method of the store does not; else NULL */
    double epsilon;           /* that the operator was built for */
    double lacking;           /* bytes that a finer trial would have needed; 0: memory was no limit */
    bool spent;               /* finer form factors of this recipe were tried and hardly lowered the error */
    bool by_noise;            /* of the operator: build_report */
    bool finest;              /* --quality high already */
    bool overlapping;         /* most of the error is that faces count twice */
    bool from_store;          /* form factors are those of a store */
} error_advice_input;

/* text: about the scene's own lights or random emission, whichever has the larger indirect error, where that
 * is above error_advice_most; else empty. Of an error asked for: about its group alone (trial.h), where that
 * is above it. An error of --group-error that is missed, and by more than that of --epsilon, comes first.
 * Single elements never count: their error is that of the noise of one element's light, for which --tolerance
 * is there. The option follows from where most of the error is: compression gets a smaller --epsilon, rays,
 * and compression that follows their noise, more of them, N ~ 1 / error^2, and the rest --quality high. A
 * trial that memory had no room for gets more --memory. */
void error_advice(const error_advice_input *input, char text[ERROR_ADVICE_BYTES]);

/* text: about light from the sky, where its error, that of the first bounce included, is above
 * error_advice_most in a scene of which at most a tenth of the light leaves (leaving_share), or above
 * error_advice_sky_large in one of which at most half does; else empty. It names --portal where rays were
 * aimed at no opening, and above error_advice_sky_large always. */
void error_advice_sky(const error_advice_input *input, double leaving_share, size_t n_aimed,
                      char text[ERROR_ADVICE_BYTES]);

#endif
