/* The light of the sky that comes through openings, as far as some rays show. Private to portals.c. */
#ifndef LAMBERT_FORMFACTOR_RAYS_PORTAL_STRENGTH_H
#define LAMBERT_FORMFACTOR_RAYS_PORTAL_STRENGTH_H

#include "solver/formfactor/visibility/visibility.h"
#include "solver/scene/facet/face_openings.h"

/* strength[o][s] of opening o: the share of the lines through it, by the cosine, along which an element on
 * side s (0: that of the normal, edge[0] x edge[1] of its patches) sees the sky on the other side. 0 where
 * more than a tenth of the light in the space on that side leaves the scene, as short walks from these
 * elements show, unless of_open. 0 also where all
 * these lines pass another opening: of the two holes of a thick wall one is enough, and *doubled is set.
 * Cost: some hundred rays and 6 KB an opening. Errors: LAM_ERR_MEMORY. */
lam_status portals_measure(const mesh *m, const visibility *v, uint64_t seed, const face_openings *openings,
                           bool of_open, double (*strength)[2], bool *doubled, lam_error *error);

/* True where more than a tenth of the light that all elements emit leaves the scene. Cost: 16,384 rays. */
bool portals_are_in_the_open(const mesh *m, const visibility *v, uint64_t seed);

#endif
