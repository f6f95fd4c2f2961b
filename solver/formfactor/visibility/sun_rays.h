/* The sunlit share of each element, by rays towards the sun. Knows no skies. */
#ifndef LAMBERT_FORMFACTOR_VISIBILITY_SUN_RAYS_H
#define LAMBERT_FORMFACTOR_VISIBILITY_SUN_RAYS_H

#include "solver/formfactor/visibility/visibility.h"

enum { SUN_RAYS_MOST = 1024 };

typedef struct sun_rays sun_rays;

/* Places n_points (1 to SUN_RAYS_MOST) points on each of the n_wanted elements in wanted, or, where that is
 * NULL, on all: one in each of n_points strips of equal area, shifted by (seed, element) alone. The mesh must
 * outlive it; freed by sun_rays_free. Memory: 12 bytes per point. Errors: LAM_ERR_MEMORY, LAM_ERR_INTERNAL.
 */
lam_status sun_rays_create(const mesh *m, size_t n_points, uint64_t seed, size_t n_wanted,
                           const uint32_t *wanted, sun_rays **out, lam_error *error);
void sun_rays_free(sun_rays *s);

/* seen[k][i] = max(0, n_i . d) times the share of element i's points whose ray in direction d = direction[k],
 * a unit vector in the scene's axes, hits nothing; where some of 16 or more hit, the share of eight times as
 * many points. Rows seen[k] are [elements]; elements that are not wanted stay unchanged. Many directions at
 * once keep more threads busy. The bits depend neither on threads nor on the other directions. */
void sun_rays_cast(const sun_rays *s, size_t n_directions, const double (*direction)[3], float *const *seen);

#endif
