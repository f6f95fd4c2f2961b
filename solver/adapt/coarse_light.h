/* A rough solution to refine a mesh by: the light of the scene's lamps, and of 1 from every element, on a
 * mesh of a few thousand elements. */
#ifndef LAMBERT_ADAPT_COARSE_LIGHT_H
#define LAMBERT_ADAPT_COARSE_LIGHT_H

#include "solver/scene/mesh.h"

enum { COARSE_LIGHTS = 2 };

typedef struct coarse_light {
    mesh m;          /* with the backs of faces that have one */
    uint32_t *first; /* [faces + 1]: the elements, or fronts, of face f are first[f] ... first[f + 1] - 1 */
    uint32_t *back;  /* [faces]: the first of its backs, in the order of the fronts; NULL: no face has any */
    size_t n_lights; /* 2, the lamps first; 1, the second alone, where there are no lamps */
    float *E, *B;    /* [n_lights][C][n] */
    bool lamps;
} coarse_light;

void coarse_light_free(coarse_light *c);

/* Divides a copy of the faces into at least COARSE_ELEMENTS elements, as few show too little of the light
 * that near ones send each other, of which it finds form factors with 256 rays each, and the converged
 * solution. Cost: about a second, or 256 rays from each face. Errors: those of form_factors_make and
 * reference_solve. */
enum { COARSE_ELEMENTS = 8000 };
lam_status coarse_light_make(const mesh *faces, uint64_t seed, const progress *p, coarse_light *out,
                             lam_error *error);

#endif
