/* The file of an open store mapped into memory: arrays are used where they lie, and processes that serve the
 * same file share its pages. A mapping is counted by who uses it and outlives the store's handle.
 *
 * What may be relied on. The bytes are the file's: nothing is read, or compared with a checksum, before it is
 * used or store_map_verify has gone over it. Writers of stores never change a file, they put another in its
 * place, which a mapping does not notice. Where somebody writes into the file all the same, what is mapped
 * changes: store_map_changed tells afterwards. Where it is cut short, touching what is gone also raises
 * SIGBUS; store_map_range says where, for a program that wants to live on. */
#ifndef LAMBERT_STORE_STORE_MAP_H
#define LAMBERT_STORE_STORE_MAP_H

#include "store/store.h"

#include <stdatomic.h>

/* Behind the last byte of the file so many more can be read. */
#define STORE_MAP_SLACK 64

/* Arrays of fewer bytes are not worth a mapping: reading and checking one takes well below a millisecond. */
#define STORE_MAP_LEAST ((size_t)1 << 20)

typedef struct store_map store_map;

/* Maps the file of a store that was opened; from then on store_view gives pointers into it. Nothing is read.
 * Errors: LAM_ERR_MEMORY, LAM_ERR_IO. */
lam_status store_map_file(store *s, lam_error *error);

/* Where an array is to be found: in a mapping, which is held for the caller, or in memory of the caller's
 * own: store_view_free gives back either. */
typedef struct store_view {
    const void *data;
    store_map *map; /* NULL: memory is not */
    void *memory;   /* NULL: map is not */
} store_view;

/* An array without copying it, where that is worth it and can be done: the store is mapped, the array has
 * STORE_MAP_LEAST bytes at least and lies where its values may. Such an array is only looked at by its header
 * and put on the list of what store_map_verify compares. Otherwise as store_read. type, rank, dims as there.
 * Errors: as store_read. */
lam_status store_read_view(store *s, const char *name, store_type type, int rank, size_t *dims,
                           store_view *view, lam_error *error);

/* Gives back what a view has; a zeroed one is allowed. */
void store_view_free(store_view *view);

/* Another user; NULL is allowed. Any thread. */
store_map *store_map_hold(store_map *map);
void store_map_release(store_map *map);

/* The mapping of a store; NULL: it has none. Not held for the caller. */
store_map *store_map_of(const store *s);

/* Address and size of the whole. */
void store_map_range(const store_map *map, const void **begin, size_t *bytes);

/* Whether the file was written to, cut or touched since the store was opened, by its size and time of
 * modification. Any thread; costs a system call. */
bool store_map_changed(const store_map *map);

/* Bytes of the arrays given out by store_read_view that lie in the mapping. */
size_t store_map_bytes(const store_map *map);

/* Compares every array given out with its checksums, until *cancel is not 0 (then LAM_ERR_CANCELLED; NULL:
 * never). Any thread, once no more are given out. LAM_ERR_DAMAGED names the file, the array and its MiB. */
lam_status store_map_verify(const store_map *map, const atomic_int *cancel, lam_error *error);

/* Names the array and the MiB that an offset from the mapping's begin lies in, as store_map_verify does; an
 * offset within none of them, the file alone. */
void store_map_name(const store_map *map, size_t offset, const char *what, lam_error *error);

#endif
