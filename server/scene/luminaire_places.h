/* The luminaires of a store as JSON, for clients that list, draw and dim them. */
#ifndef LAMBERT_SERVER_SCENE_LUMINAIRE_PLACES_H
#define LAMBERT_SERVER_SCENE_LUMINAIRE_PLACES_H

#include "lambert/lambert.h"
#include "solver/codec/buffer.h"

/* Sets *out (empty before) to the JSON of GET /v1/scenes/NAME/luminaires, a line with its end; NULL leaves it
 * empty. O(k + groups). Errors: LAM_ERR_MEMORY. */
lam_status luminaire_places_write(const lam_luminaires *luminaires, buffer *out, lam_error *error);

#endif
