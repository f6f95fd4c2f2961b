/* Whether what a scene has mapped is known to be what was written; beside the scene, which is immutable. */
#ifndef LAMBERT_SERVER_SCENE_SCENE_HEALTH_H
#define LAMBERT_SERVER_SCENE_SCENE_HEALTH_H

#include "server/scene/map_guard.h"
#include "server/scene/scene.h"

enum { HEALTH_UNKNOWN, HEALTH_SOUND, HEALTH_DAMAGED };

struct scene_health {
    atomic_int state;
    atomic_bool told;
    map_range *guard; /* NULL: nothing is mapped */
    lam_error damage; /* of HEALTH_DAMAGED, written before */
};

/* Guards the mapping, NULL for none; sound: it has been compared already. The caller frees with
 * scene_health_free, while the mapping is there. Errors: LAM_ERR_MEMORY. */
lam_status scene_health_create(const char *path, const store_map *map, bool sound, scene_health **out,
                               lam_error *error);
void scene_health_free(scene_health *health);

#endif
