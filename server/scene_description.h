/* The JSON of GET /v1/scenes/NAME, made once when a store is read. */
#ifndef LAMBERT_SERVER_SCENE_DESCRIPTION_H
#define LAMBERT_SERVER_SCENE_DESCRIPTION_H

#include "server/scene.h"
#include "store/store.h"

/* *text is the contract's object, on one line; the caller frees it. Reads attributes of s, and sizes, groups
 * and name of what was loaded. */
lam_status scene_describe(store *s, const scene *loaded, char **text, lam_error *error);

#endif
