/* The scenes that are served: an immutable snapshot, counted by its users and swapped whole on a reload. */
#ifndef LAMBERT_SERVER_SCENE_CATALOG_H
#define LAMBERT_SERVER_SCENE_CATALOG_H

#include "server/config.h"
#include "server/scene/scene.h"

typedef struct catalog_snapshot {
    atomic_size_t references;
    size_t n_scenes;
    scene **scenes; /* by name */
} catalog_snapshot;

typedef struct catalog catalog;

/* An empty catalog of what c names; c must outlive it. Lines about its scenes go to `out` (served, verified)
 * or `problems` (refused, damaged), all of them flushed. */
lam_status catalog_create(const config *c, FILE *out, FILE *problems, catalog **made, lam_error *error);
void catalog_destroy(catalog *all);

/* Reads every store (again) and swaps the snapshot. A file that is the same as before keeps its scene; a
 * store that cannot be read keeps the scene read before, or is left out, as is one that does not fit into
 * --max-memory. What is mapped is verified after this. Variants of a scene that is kept stay, others are
 * dropped. Returns how many are served. One thread at a time. */
size_t catalog_reload(catalog *all);

/* The present snapshot, held until it is released. Any thread. */
catalog_snapshot *catalog_acquire(catalog *all);
void catalog_release(catalog_snapshot *snapshot);

/* Serves a variant beside its base, in place of one of its name; takes it over, also on an error. Any thread.
 * Errors: LAM_ERR_CANCELLED (its base is not served any more), LAM_ERR_ARGUMENT (a store has its name),
 * LAM_ERR_MEMORY. */
lam_status catalog_put_variant(catalog *all, scene *variant, lam_error *error);

/* Takes the variant of this name out. Any thread. Errors: LAM_ERR_ARGUMENT (there is none), LAM_ERR_MEMORY.
 */
lam_status catalog_remove_variant(catalog *all, const char *name, lam_error *error);

/* NULL when there is no scene of this name. */
const scene *catalog_find(const catalog_snapshot *snapshot, const char *name);

#endif
