/* Groups that people light in a scene without lamps: its windows, by their names, and its largest surfaces.
 */
#ifndef LAMBERT_SCENE_LIT_GROUPS_H
#define LAMBERT_SCENE_LIT_GROUPS_H

#include "solver/scene/mesh.h"

/* True where window, glass, glazing or pane is in the name, in small or capital letters. */
bool group_name_is_window(const char *name);

/* The light of each group, light_of [n_groups]: all windows together are one, and the largest other groups
 * are one each, lights in all; LIT_NOT of the others. A scene of one group has none, as that is the light of
 * all elements. Cost: O(n + lights n_groups). Errors: LAM_ERR_MEMORY. */
enum { LIT_NOT = 255 };
lam_status lit_groups_find(const mesh *m, size_t lights_most, uint8_t *light_of, size_t *lights,
                           lam_error *error);

#endif
