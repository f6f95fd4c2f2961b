/* The stores that a configuration names, and what their scenes are called. */
#ifndef LAMBERT_SERVER_SCENE_SOURCES_H
#define LAMBERT_SERVER_SCENE_SOURCES_H

#include "server/config.h"
#include "store/status.h"

/* A store to read, and the name of its scene: the one given, or the stem of its file. */
typedef struct source {
    char *path, *name;
} source;

typedef struct source_list {
    source *items;
    size_t count, capacity;
} source_list;

/* Every store that the configuration names now: those given, then every *.h5 of --stores by name. Errors:
 * LAM_ERR_IO (the folder cannot be read), LAM_ERR_MEMORY; the list is freed in any case. */
lam_status sources_find(const config *c, source_list *sources, lam_error *error);
void sources_free(source_list *list);

#endif
