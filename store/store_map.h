/* The file of an open store mapped into memory: arrays are used in place, and processes that serve the same
 * file share its pages. A mapping is reference-counted and outlives the handle of the store.
 *
 * Mapped bytes are read from the file when they are used, and compared with checksums by store_map_verify
 * alone. Writers of stores never change a file: they replace it, which does not affect a mapping. If another
 * program writes into the file, mapped bytes change, which store_map_changed reports afterwards. If it is
 * truncated, reading lost pages raises SIGBUS; store_map_range gives the range for a program that handles
 * this signal. */
#ifndef LAMBERT_STORE_STORE_MAP_H
#define LAMBERT_STORE_STORE_MAP_H

#include "store/store.h"

/* Bytes that can be read behind the end of the file. */
#define STORE_MAP_SLACK 64

/* Smaller arrays are read: they hardly count. */
#define STORE_MAP_LEAST ((size_t)64 << 10)

typedef struct store_map store_map;

/* Maps the file of an opened store, so that store_read_view gives pointers into it. Nothing is read. Errors:
 * LAM_ERR_MEMORY, LAM_ERR_IO. */
lam_status store_map_file(store *s, lam_error *error);

/* Has the pages of the file that are in memory, or on the disk, all mapped at once, which costs less than one
 * by one when they are used. Any thread; nothing is wrong where it fails. */
void store_map_populate(const store_map *map);

/* An array in a mapping, which is held for the caller, or in memory of its own; freed by store_view_free. */
typedef struct store_view {
    const void *data;
    store_map *map; /* NULL: memory is not */
    void *memory;   /* NULL: map is not */
} store_view;

/* An array in place if the store is mapped and the array is aligned and has at least STORE_MAP_LEAST bytes:
 * only its header is read, and store_map_verify will compare it. Any other array is read as by store_read.
 * type, rank, dims as there. Errors: as store_read. */
lam_status store_read_view(store *s, const char *name, store_type type, int rank, size_t *dims,
                           store_view *view, lam_error *error);

/* Has store_map_verify look at a mapped array, too, for what `limit` rules out: `check` is given its data and
 * the bytes [from, to) that are compared just then, and says if what ends there is good. words, static, say
 * what is wrong. Nothing happens for a view in memory. */
typedef bool store_check(const void *data, size_t from, size_t to, uint64_t limit);
void store_view_check(const store_view *view, store_check *check, uint64_t limit, const char *words);

/* Frees a view; a zeroed one is allowed. */
void store_view_free(store_view *view);

/* Adds a reference; NULL is allowed. Any thread. */
store_map *store_map_hold(store_map *map);
void store_map_release(store_map *map);

/* The mapping of a store, or NULL; not held for the caller. */
store_map *store_map_of(const store *s);

/* Address and size of the mapping. */
void store_map_range(const store_map *map, const void **begin, size_t *bytes);

/* True if size or modification time of the file have changed since the store was opened. Any thread; costs a
 * system call. */
bool store_map_changed(const store_map *map);

/* Bytes of the arrays that store_read_view gave out of the mapping. */
size_t store_map_bytes(const store_map *map);

/* Compares these arrays with their checksums, and looks for numbers that are not finite, or fail the check of
 * their view, until `stop` says so (LAM_ERR_CANCELLED; it is asked before each MiB, and may be NULL). Any
 * thread, after the last store_read_view. LAM_ERR_DAMAGED names the file, the array and its MiB. */
lam_status store_map_verify(const store_map *map, const stop_check *stop, lam_error *error);

/* The message for an offset in the mapping: names the array and the MiB, as store_map_verify does, or,
 * outside all arrays, the file alone. */
void store_map_name(const store_map *map, size_t offset, const char *what, lam_error *error);

#endif
