/* Survives the loss of mapped pages: a file was truncated, or its disk failed. The kernel raises SIGBUS in
 * the thread that reads such a page. The handler maps zeros in its place and marks the range, so that answers
 * computed from it are discarded. Any other SIGBUS ends the process as usual.
 *
 * A signal handler takes no arguments of its own: the ranges are the only mutable static data of the program.
 */
#ifndef LAMBERT_SERVER_SCENE_MAP_GUARD_H
#define LAMBERT_SERVER_SCENE_MAP_GUARD_H

#include <stdbool.h>
#include <stddef.h>

#define MAP_GUARD_RANGES 4096

typedef struct map_range map_range;

/* Installs the handler; once, before any range is added. */
void map_guard_install(void);

/* Unblocks SIGBUS in the calling thread and those it starts: where it is blocked, the kernel ends the process
 * without calling the handler. */
void map_guard_allow(void);

/* Guards a mapping that begins at a page, until map_guard_remove, to be called before it is unmapped. NULL if
 * there are MAP_GUARD_RANGES already. Any thread. */
map_range *map_guard_add(const void *begin, size_t bytes);
void map_guard_remove(map_range *range);

/* True if a page was lost; *offset is that of the first one read. False for NULL. Any thread. */
bool map_guard_lost(const map_range *range, size_t *offset);

#endif
