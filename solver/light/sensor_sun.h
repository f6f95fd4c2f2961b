/* The sun itself at the sensors of a store. */
#ifndef LAMBERT_LIGHT_SENSOR_SUN_H
#define LAMBERT_LIGHT_SENSOR_SUN_H

#include "lambert/lambert.h"
#include "solver/daylight/sky_tiles.h"
#include "solver/scene/mesh.h"
#include "solver/shadow/sun_places.h"
#include "store/store.h"

typedef struct sensor_sun {
    size_t n; /* receivers */
    shadow_tree *tree;
    sun_places *places;
    float *ground;    /* [n], of the irradiance of the ground */
    const float *sky; /* [tiles][n], weights of the tiles; owned by the sensors */
} sensor_sun;

/* The sensors l, which outlive it, are those of the store s with the mesh m, whose sky has this tiling. Freed
 * by sensor_sun_free. Errors: LAM_ERR_FORMAT (no sky at the sensors), LAM_ERR_MEMORY. */
lam_status sensor_sun_create(store *s, const mesh *m, const lam_sensors *l, const sky_tiling *tiling,
                             sensor_sun **out, lam_error *error);

/* NULL is allowed. */
void sensor_sun_free(sensor_sun *s);

#endif
