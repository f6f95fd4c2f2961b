/* The stores that were refused when stores were read last, by the names that their scenes would have, for
 * clients: without paths. Shared by reference counts; immutable once it is shared. */
#ifndef LAMBERT_SERVER_SCENE_REFUSALS_H
#define LAMBERT_SERVER_SCENE_REFUSALS_H

#include "solver/codec/buffer.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>

typedef struct refused_store {
    char *name, *reason;
    bool kept; /* the scene that was read from it before is served on */
} refused_store;

typedef struct refusals {
    atomic_size_t references;
    size_t count, capacity;
    refused_store *items;
} refusals;

/* An empty list with one reference; NULL if memory is short. */
refusals *refusals_create(void);

/* Adds the store at `path`: the reason is the message without this path and its folder. A store for which
 * memory is short is left out. */
void refusals_add(refusals *list, const char *path, const char *name, const char *message, bool kept);

/* Appends ,"refused":[{"name":…,"reason":…,"kept":…}…], or nothing where no store was refused. */
bool refusals_write(const refusals *list, buffer *b);

refusals *refusals_hold(refusals *list);
void refusals_release(refusals *list); /* NULL is allowed */

#endif
