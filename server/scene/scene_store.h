/* The store of a scene, opened again for arrays that the scene does not hold. Any thread. */
#ifndef LAMBERT_SERVER_SCENE_SCENE_STORE_H
#define LAMBERT_SERVER_SCENE_SCENE_STORE_H

#include "server/scene/scene.h"

/* The store of a scene, or of a variant's base. */
static inline const scene *scene_root(const scene *s) {
    return s->base != NULL ? s->base : s;
}

/* Opens that store, to be closed by the caller, also on an error, and checks that it still is the one that
 * was read. Errors: those of store_open; LAM_ERR_IO if the file was replaced. */
lam_status scene_store_open(const scene *of, store **out, lam_error *error);

#endif
