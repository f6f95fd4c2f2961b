/* The sensors of a store as JSON, for clients that list, draw and read them. */
#ifndef LAMBERT_SERVER_SCENE_SENSOR_PLACES_H
#define LAMBERT_SERVER_SCENE_SENSOR_PLACES_H

#include "lambert/lambert.h"
#include "solver/codec/buffer.h"

/* Sets *out (empty before) to the JSON of GET /v1/scenes/NAME/sensors, a line with its end; NULL leaves it
 * empty. O(receivers). Errors: LAM_ERR_MEMORY. */
lam_status sensor_places_write(const lam_sensors *sensors, buffer *out, lam_error *error);

#endif
