/* The sun at receivers of light, such as sensors, by rays from each of them to the sun. Knows no skies, nor
 * who stores receivers. */
#ifndef LAMBERT_SHADOW_SUN_PLACES_H
#define LAMBERT_SHADOW_SUN_PLACES_H

#include "solver/base/receiver_weight.h"
#include "solver/shadow/shadow_tree.h"

/* Receivers in a scene. Immutable once created; any number of threads may ask it. */
typedef struct sun_places sun_places;

/* Copies n receivers, and moves those that lie on faces off them: on the front of a face, or behind it by no
 * more than a millimetre or a ten-thousandth of the scene; a plane that looks into a face lies behind it
 * (solver/sensor/sensor_rows.h). Freed by sun_places_free. Cost: O(log n) of the elements, for each.
 * Errors: LAM_ERR_MEMORY. */
lam_status sun_places_create(const shadow_tree *t, size_t n, const placed_receiver *receivers,
                             sun_places **out, lam_error *error);

/* NULL is allowed. */
void sun_places_free(sun_places *p);

/* Bytes that n receivers take. */
size_t sun_places_bytes(size_t n);

/* seen[k][i] = the weight of receiver i in direction d = direction[k], a unit vector in the scene's axes,
 * times what comes through there: 0, 1, or what panes pass. Times the irradiance of a plane normal to the sun
 * it is that of the receiver. Rows seen[k] are [receivers]. t is the tree that places were made for. At most
 * n_threads threads take part (solver/base/parallel.h). The bits depend neither on threads nor on the other
 * directions. Cost: about a microsecond for a ray. */
void sun_places_find(const sun_places *p, const shadow_tree *t, size_t n_threads, size_t n_directions,
                     const double (*direction)[3], float *const *seen);

#endif
