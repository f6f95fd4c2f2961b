/* The kind of light that a store counts, W or lm: an attribute of /mesh. Both programs read it. */
#ifndef LAMBERT_BASE_SCENE_LIGHTS_H
#define LAMBERT_BASE_SCENE_LIGHTS_H

#include "solver/base/photometry.h"
#include "store/store.h"

/* A store without the attribute, an older one, counts in W. Errors: LAM_ERR_FORMAT for any other word. */
lam_status scene_lights_load(store *s, light_kind *out, lam_error *error);

/* Writes the attribute. */
lam_status scene_lights_save(light_kind lights, store *s, lam_error *error);

#endif
