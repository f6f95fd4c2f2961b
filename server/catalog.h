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

/* An empty catalog of what c names; c must outlive it. Lines about its scenes go to `out` (served, verified)
 * or `problems` (refused, damaged), all of them flushed. */
lam_status catalog_create(const config *c, FILE *out, FILE *problems, catalog **made, lam_error *error);
void catalog_destroy(catalog *all);

/* Reads every store (again) and swaps the snapshot. A file that is the same as before keeps its scene; a
 * store that cannot be read keeps the scene read before, or is left out, as is one that does not fit into
 * --max-memory. What is mapped is verified after this. Returns how many are served. One thread at a time. */
size_t catalog_reload(catalog *all);

/* The present snapshot, held until it is released. Any thread. */
catalog_snapshot *catalog_acquire(catalog *all);
void catalog_release(catalog_snapshot *snapshot);

/* NULL when there is no scene of this name. */
const scene *catalog_find(const catalog_snapshot *snapshot, const char *name);

#endif
