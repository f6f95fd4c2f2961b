/* The scenes that are served, as an immutable, reference-counted snapshot that a reload replaces as a whole.
 */
#ifndef LAMBERT_SERVER_SCENE_CATALOG_H
#define LAMBERT_SERVER_SCENE_CATALOG_H

#include "server/config.h"
#include "server/scene/refusals.h"
#include "server/scene/scene.h"
#include "server/scene/scene_list.h"

/* More than the bytes of any scene's name, as a path has it. */
enum { CATALOG_NAME_MAX = 256 };

typedef struct catalog_snapshot {
    atomic_size_t references;
    size_t n_scenes;
    scene **scenes;    /* by name */
    refusals *refused; /* held */
    scene_list *list;  /* of the scenes */
} catalog_snapshot;

typedef struct catalog catalog;

/* Makes an empty catalog for the stores that c names; c outlives it. Lines about scenes go to `out` (served,
 * verified) and `problems` (refused, damaged) and are flushed. */
lam_status catalog_create(const config *c, FILE *out, FILE *problems, catalog **made, lam_error *error);
void catalog_destroy(catalog *all);

/* Reads every store and replaces the snapshot. An unchanged file keeps its scene. A store that cannot be read
 * keeps the scene read before, or is left out if there is none or it exceeds --max-memory. Mapped arrays of
 * --verify-below or more are verified later. Variants of kept scenes stay, others are dropped. Returns the
 * number of scenes served. Once `stop` (or NULL) says so, asked as scene_open does, the rest is left, and the
 * snapshot stays as it was. One thread at a time. */
size_t catalog_reload(catalog *all, const stop_check *stop);

/* True if every store could be read when stores were read last, and none was refused. Any thread. */
bool catalog_read_all(const catalog *all);

/* Has the mapped arrays of a scene that is served compared again, as an answer makes one doubt them; at most
 * once in a minute. Any thread. */
void catalog_doubt(catalog *all, const scene *s);

/* The number of stores that are served, each of which holds a descriptor where it is mapped; before any is,
 * of those that will be read. */
size_t catalog_stores(catalog *all);

/* The present snapshot, valid until it is released. Any thread. */
catalog_snapshot *catalog_acquire(catalog *all);
void catalog_release(catalog_snapshot *snapshot);

/* Serves a variant beside its base, in place of a variant of this name. Takes it over, also on an error. Any
 * thread. Errors: LAM_ERR_CANCELLED (its base is not served any more), LAM_ERR_ARGUMENT (a store has its
 * name), LAM_ERR_MEMORY. */
lam_status catalog_put_variant(catalog *all, scene *variant, lam_error *error);

/* Takes the variant of this name out of service. Any thread. Errors: LAM_ERR_ARGUMENT (there is none),
 * LAM_ERR_MEMORY. */
lam_status catalog_remove_variant(catalog *all, const char *name, lam_error *error);

/* The scene of this name, or NULL. */
const scene *catalog_find(const catalog_snapshot *snapshot, const char *name);

#endif
