/* The scenes that are served: an immutable snapshot, counted by its users and swapped whole on a reload. */
#ifndef LAMBERT_SERVER_CATALOG_H
#define LAMBERT_SERVER_CATALOG_H

#include "server/config.h"
#include "server/scene.h"

typedef struct catalog_snapshot {
    atomic_size_t references;
    size_t n_scenes;
    scene **scenes; /* by name */
} catalog_snapshot;

typedef struct catalog catalog;

/* An empty catalog of what c names; c must outlive it. */
lam_status catalog_create(const config *c, catalog **out, lam_error *error);
void catalog_destroy(catalog *all);

/* Reads every store (again) and swaps the snapshot. A store that cannot be read keeps the scene read before,
 * or is left out; one that is as it was keeps it too, and its variants with it. Variants of others are
 * dropped. Says a line for each on `out` (served) or `problems` (refused), all of them flushed. Returns how
 * many are served. One thread at a time. */
size_t catalog_reload(catalog *all, FILE *out, FILE *problems);

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
