/* What happens when part of a mapped store cannot be read any more: somebody cut the file short, its disk
 * failed. The kernel then raises SIGBUS in whatever thread touches it; here zeros take the place of what is
 * gone, and the range remembers that it lost something, so that whoever read it can throw the answer away. A
 * SIGBUS from anywhere else ends the process as ever.
 *
 * A signal handler can be told nothing but by what lies in one place: the ranges are the program's only
 * mutable static data. */
#ifndef LAMBERT_SERVER_SCENE_MAP_GUARD_H
#define LAMBERT_SERVER_SCENE_MAP_GUARD_H

#include <stdbool.h>
#include <stddef.h>

/* Ranges at most. */
#define MAP_GUARD_RANGES 4096

typedef struct map_range map_range;

/* Sets the handler up for the process; once, before any range is added. */
void map_guard_install(void);

/* Lets the calling thread, and those it starts, live through a SIGBUS: where the signal is blocked the kernel
 * ends the process without asking. */
void map_guard_allow(void);

/* Guards a mapping from begin (at a page) on, until it is given back, which is before it is unmapped. NULL
 * when there are MAP_GUARD_RANGES already. Any thread. */
map_range *map_guard_add(const void *begin, size_t bytes);
void map_guard_remove(map_range *range);

/* Whether something was lost, and the first place of it that was touched. Any thread; NULL: never. */
bool map_guard_lost(const map_range *range, size_t *offset);

#endif
