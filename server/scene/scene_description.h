/* The JSON of GET /v1/scenes/NAME, made once when a store is read. */
#ifndef LAMBERT_SERVER_SCENE_SCENE_DESCRIPTION_H
#define LAMBERT_SERVER_SCENE_SCENE_DESCRIPTION_H

#include "server/scene/scene.h"
#include "store/store.h"

/* *text is what the store says of itself under the name it was loaded by, on one line; the caller frees it.
 */
lam_status scene_describe(store *s, const scene *loaded, char **text, lam_error *error);

/* The same of a variant: what its base says, but its own name and bytes, whose variant it is, its
 * reflectances (groups, a JSON object as text), and no error figures. Errors: LAM_ERR_MEMORY. */
lam_status scene_describe_variant(const scene *variant, const char *groups, char **text, lam_error *error);

#endif
