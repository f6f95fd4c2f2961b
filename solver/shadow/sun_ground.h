/* The light of a ground that the sun lights, on the elements of a scene. */
#ifndef LAMBERT_SHADOW_SUN_GROUND_H
#define LAMBERT_SHADOW_SUN_GROUND_H

#include "solver/base/receiver_weight.h"
#include "solver/daylight/sky_tiles.h"

/* ground [n]: the irradiance of each element by an unshaded ground of this albedo, of the ground's own. It is
 * found from the tiles that an element does not see, where first_bounce [tiles][n] is a F_ground c: the least
 * of first_bounce / c, at most the share of an open ground at this inclination, a (1 - n_up) / 2. normal is
 * [n][3], of fronts. Cost: O(tiles n). */
void sun_ground_find(const sky_tiling *tiling, double albedo, const float *first_bounce, size_t n,
                     const float (*normal)[3], float *ground);

/* The same of receivers, whose weights of tiles sky [tiles][n] have the ground in them likewise: at most the
 * share of an open ground of the weight of each (receiver_weight.h). */
void sun_ground_at(const sky_tiling *tiling, double albedo, const float *sky, size_t n,
                   const placed_receiver *receivers, float *ground);

#endif
