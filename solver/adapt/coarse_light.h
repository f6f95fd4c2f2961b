/* A rough solution to refine a mesh by: the light of the scene's lamps, or of groups that people light where
 * it has neither lamps nor a sky, of 1 from every element, and of an even sky, on a mesh of a few thousand
 * elements. */
#ifndef LAMBERT_ADAPT_COARSE_LIGHT_H
#define LAMBERT_ADAPT_COARSE_LIGHT_H

#include "solver/adapt/gather.h"
#include "solver/formfactor/sky_bounce.h"
#include "solver/scene/facet/face_openings.h"
#include "solver/scene/mesh.h"

/* Lights at most: of lamps or COARSE_LIT of groups, of all elements, and of the sky, in this order; only that
 * of all elements is always there. */
enum { COARSE_LIGHTS = 3, COARSE_LIT = 2 };

/* The sky that lights the store; openings, or NULL, as form_factor_options has them. */
typedef struct coarse_sky {
    double ground_albedo;
    const face_openings *openings;
} coarse_sky;

/* The lights beside those of elements, each NULL where there is none: the sky, and direct light of
 * luminaires, which is one with the light of lamps. Views. */
typedef struct coarse_sources {
    const coarse_sky *sky;
    const gather_direct *direct;
} coarse_sources;

typedef struct coarse_light {
    mesh m;          /* with the backs of faces that have one */
    uint32_t *first; /* [faces + 1]: the elements, or fronts, of face f are first[f] ... first[f + 1] - 1 */
    uint32_t *back;  /* [faces]: the first of its backs, in the order of the fronts; NULL: no face has any */
    size_t n_lights; /* of those that there are */
    float *E, *B;    /* [n_lights][C][n]; of the sky E is 0 */
    float *first_light; /* [C][n], irradiance by direct light, of the light of lamps; NULL: none */
    bool lamps, sky;
    size_t n_lit;      /* lights of groups (lit_groups.h), which come first; 0 beside lamps or a sky */
    sky_bounce bounce; /* of a sky of one tile */
    double L[2 * COARSE_LIGHTS]; /* [n_lights][2]: radiances of that tile and of the ground, by light */
} coarse_light;

/* The place of the light of all elements. */
static inline size_t coarse_light_even(const coarse_light *c) {
    return c->lamps ? 1 : c->n_lit;
}

void coarse_light_free(coarse_light *c);

/* Divides a copy of the faces into at least COARSE_ELEMENTS elements, as few show too little of the light
 * that near ones send each other, of which it finds form factors with 64 to 256 rays each, and the converged
 * solution. Cost: about a second, or 64 rays from each face. Errors: those of
 * form_factors_make and reference_solve. */
enum { COARSE_ELEMENTS = 8000 };
/* The memory that it takes for a number of faces, about, at most. */
double coarse_light_bytes(size_t faces);
lam_status coarse_light_make(const mesh *faces, const coarse_sources *from, uint64_t seed, const progress *p,
                             coarse_light *out, lam_error *error);

#endif
