/* The scenes of a snapshot that are in service, as the JSON of GET /v1/scenes. Any thread. */
#ifndef LAMBERT_SERVER_SCENE_SCENE_LIST_H
#define LAMBERT_SERVER_SCENE_SCENE_LIST_H

#include "server/scene/refusals.h"
#include "server/scene/scene.h"

typedef struct scene_list scene_list;

/* Errors: LAM_ERR_MEMORY. */
lam_status scene_list_create(scene_list **out, lam_error *error);

/* NULL is allowed. */
void scene_list_destroy(scene_list *list);

/* The text for these scenes and the stores that were refused, which are always the same ones: a reference for
 * the caller, or NULL if memory is short. It is made when it is first asked for, and anew when the look at
 * the scenes finds others damaged than before. Of many scenes a look is kept for a tenth of a second. */
kept_forms *scene_list_get(scene_list *list, size_t n_scenes, scene *const *scenes, const refusals *refused);

#endif
