/* The light that comes straight from a moving light, by segments between every element and every position. */
#ifndef LAMBERT_WALK_DIRECT_LIGHT_H
#define LAMBERT_WALK_DIRECT_LIGHT_H

#include "solver/walk/moving_light.h"
#include "solver/walk/walk.h"

typedef struct direct_light_problem {
    const moving_light *light;
    size_t samples; /* of an element and a position on average, at most; 16 come on top for a pilot */
    uint64_t seed;  /* the bits depend on it, not on threads */
    const progress *progress;
    const char *stage;
} direct_light_problem;

/* F[i][l], [n][s]: the form factor from element i to the light at position l, which is the mean irradiance of
 * the element where 1 W/m^2 leaves the light; and its variance by the sampling, the square of half the
 * difference of two independent halves of the samples. Unbiased. Exactly 0, both, where corners show that
 * one is behind the other. Elements and positions have as many samples as lower the error of the position
 * most, which an independent pilot decides. Cost: n s (16 + `samples`) segments. Errors: LAM_ERR_CANCELLED.
 */
lam_status walk_direct_light(const walk_scene *s, const direct_light_problem *problem, float *F,
                             float *variance, lam_error *error);

#endif
