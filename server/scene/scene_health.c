#include "server/scene/scene_health.h"

#include <stdlib.h>

lam_status scene_health_create(const char *path, const store_map *map, bool sound, scene_health **out,
                               lam_error *error) {
    lam_status status = LAM_OK;
    scene_health *made = memory_allocate(1, sizeof *made, path, error);
    if (made == NULL) return LAM_ERR_MEMORY;
    atomic_init(&made->state, sound || map == NULL ? HEALTH_SOUND : HEALTH_UNKNOWN);
    atomic_init(&made->told, false);
    if (map != NULL) {
        const void *begin;
        size_t bytes;
        store_map_range(map, &begin, &bytes);
        made->guard = map_guard_add(begin, bytes);
        if (made->guard == NULL)
            FAIL(error, LAM_ERR_MEMORY, "%s: more than %d stores are mapped; serve fewer", path,
                 MAP_GUARD_RANGES);
    }
    *out = made;
    made = NULL;
done:
    scene_health_free(made);
    return status;
}

void scene_health_free(scene_health *health) {
    if (health == NULL) return;
    map_guard_remove(health->guard);
    free(health);
}

lam_status scene_verify(scene *s, const atomic_int *cancel, lam_error *error) {
    scene_health *health = s->health;
    lam_error damage;
    if (scene_verified(s)) return LAM_OK;
    const lam_status status = store_map_verify(s->map, cancel, &damage);
    if (status == LAM_OK) atomic_store(&health->state, HEALTH_SOUND);
    if (status == LAM_ERR_DAMAGED) {
        health->damage = damage;
        atomic_store(&health->state, HEALTH_DAMAGED);
    }
    if (status != LAM_OK && error != NULL) *error = damage;
    return status;
}

bool scene_verified(const scene *s) {
    return atomic_load(&s->health->state) != HEALTH_UNKNOWN;
}

bool scene_damaged(const scene *s, lam_error *why, bool *news) {
    scene_health *health = s->health;
    size_t offset;
    lam_error unused;
    if (why == NULL) why = &unused;
    /* What was lost is asked for first: a comparison finds its zeros too, and says less. */
    if (map_guard_lost(health->guard, &offset))
        store_map_name(s->map, offset, "cannot be read any more", why);
    else if (atomic_load(&health->state) == HEALTH_DAMAGED)
        *why = health->damage;
    else if (s->map != NULL && store_map_changed(s->map))
        (void)status_fail(why, LAM_ERR_DAMAGED,
                          "%s: was changed since it was mapped; put a new file in its place by renaming, and "
                          "have the stores read again (SIGHUP)",
                          s->path);
    else
        return false;
    if (news != NULL) *news = !atomic_exchange(&health->told, true);
    return true;
}
