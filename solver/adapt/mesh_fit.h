/* The mesh by preset: the faces of a file as they are where constants on them leave little of the light, else
 * divided evenly, or where light changes, until they do. Must not know operators. */
#ifndef LAMBERT_ADAPT_MESH_FIT_H
#define LAMBERT_ADAPT_MESH_FIT_H

#include "solver/adapt/adaptive.h"

typedef struct mesh_fit_options {
    double error;        /* |error| / |B - E| that constants on elements may leave, for each light */
    size_t elements;     /* at most, both sides counted, and never fewer than there are faces */
    double effort;       /* share of the points that a division by the light may look at, at most 1 */
    coarse_sources from; /* that light the scene, beside its lamps */
    lam_status (*cut)(void *of,
                      lam_error *error); /* cuts the faces, before they are divided; NULL: nothing does */
    void *cut_of;
    uint64_t seed;
    const progress *progress;
} mesh_fit_options;

typedef enum mesh_fit_way { MESH_FIT_FACES, MESH_FIT_EVEN, MESH_FIT_LIGHT } mesh_fit_way;

typedef struct mesh_fit_report {
    mesh_fit_way way;
    mesh_estimate faces, left; /* by the faces as they were, and by the mesh that was made */
    bool reached;              /* the largest error is at most what was asked for */
} mesh_fit_report;

/* Divides the faces of a mesh in place, or leaves them. They are first divided evenly, as one such element
 * costs a tenth of one that is fitted to the light; by the light where that would take more than some
 * thousands. The lights are the scene's lamps, 1 from every element, and an even sky. Deterministic, for any
 * number of threads. Cost: a coarse solution, about 5,000 points for each of up to six even divisions, and at
 * most 300,000 points for one by the light, at 192 rays and segments each. Errors: those of
 * coarse_light_make, mesh_refine and mesh_of_cells. */
lam_status mesh_fit(mesh *m, const mesh_fit_options *how, mesh_fit_report *report, lam_error *error);

#endif
