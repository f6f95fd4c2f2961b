/* The share of each element that the sun lights, by rays to the sun. Knows no skies. */
#ifndef LAMBERT_SHADOW_SUN_SHARES_H
#define LAMBERT_SHADOW_SUN_SHARES_H

#include "solver/shadow/shadow_tree.h"

/* Points of an element that are tested in a moment, and what the places of all points depend on beside the
 * element and their numbers: solver/formfactor/visibility/sun_rays.h has the same points. */
enum { SUN_POINTS = 16, SUN_SEED = 20 };

/* seen[k][i] = max(0, n_i . d) times the share of SUN_POINTS points of element i whose ray in direction
 * d = direction[k], a unit vector in the scene's axes, meets nothing; where some do, of eight times as many.
 * Rows seen[k] are [elements]. At most n_threads threads take part (solver/base/parallel.h). The bits depend
 * neither on threads nor on the other directions. Cost: some 10 million points a second and thread. */
void sun_shares_find(const shadow_tree *t, size_t n_threads, size_t n_directions,
                     const double (*direction)[3], float *const *seen);

#endif
