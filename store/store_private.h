/* What the files of store/ share: the open file, its table of checksums, one array of it. No other header
 * includes <hdf5.h>. */
#ifndef LAMBERT_STORE_STORE_PRIVATE_H
#define LAMBERT_STORE_STORE_PRIVATE_H

#include "store/status.h"
#include "store/store.h"
#include "store/store_map.h"

#include <hdf5.h>

/* Values go to the file and are hashed as they lie in memory. */
_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "stores are little-endian");

#define STORE_FORMAT "lambert"
#define STORE_PIECE ((size_t)1 << 20) /* bytes under one checksum */
#define STORE_NAME_SIZE 256           /* longest HDF5 path here, its NUL included */
#define STORE_MAX_DEPTH 8             /* groups within groups */

/* The file below HDF5 (store_driver.c). */
typedef struct store_file {
    int fd;
    bool writable;
    int error;     /* errno of the first failed access; from then on writes are dropped */
    uint64_t size; /* of the file; while writing: as if no write had been dropped */
} store_file;

/* The checksums of one dataset: XXH3 of each piece of its bytes. */
typedef struct store_sum {
    char *name; /* HDF5 path, owned */
    size_t n_pieces;
    uint64_t *pieces; /* owned */
} store_sum;

/* Sorted by name (byte order). */
typedef struct store_sums {
    size_t count, capacity;
    store_sum *entries;
} store_sums;

struct store {
    char *path;    /* as given */
    char *target;  /* what partial is renamed to; NULL when reading */
    char *partial; /* NULL when reading */
    bool broken;   /* a call failed while writing: cannot be sealed */
    store_file file;
    hid_t h5; /* negative: none */
    store_sums sums;
    store_identity identity; /* of an opened file */
    store_map *map;          /* of an opened file, held; NULL: none */
};

/* HDF5 prints its errors unless told not to: muted while one of our functions runs, then as it was. */
typedef struct store_mute {
    H5E_auto2_t print;
    void *context;
} store_mute;
store_mute store_mute_begin(void);
void store_mute_end(const store_mute *mute);

/* --- store.c: paths inside the file ------------------------------------------------------------------- */

/* Whether name is an absolute path that a store may use; else LAM_ERR_ARGUMENT. */
lam_status store_name_check(const store *s, const char *name, lam_error *error);

/* 1 when the path leads to an object, 0 when not, negative when the file is damaged there. */
int store_exists(const store *s, const char *name);

/* Turns a failed HDF5 call into a status and a message; call it before any other HDF5 function.
 * what: the verb, "write", "read". */
lam_status store_hdf5_failure(store *s, const char *name, const char *what, lam_error *error);

/* --- store_probe.c ------------------------------------------------------------------------------------- */

typedef lam_status store_opener(const char *path, store **out, lam_error *error);

/* Whether opening the file and reading its headers ends well or in a refusal: tried in a child process.
 * Errors: LAM_ERR_DAMAGED when that crashes, or never ends. */
lam_status store_probe(store_opener *opener, const char *path, lam_error *error);

/* --- store_driver.c ------------------------------------------------------------------------------------ */

/* File access properties that go through file, which must outlive the HDF5 file; negative when that fails. */
hid_t store_driver_properties(store_file *file);

/* Reads exactly size bytes at offset; false: file->error is set, EIO when the file ends before. */
bool store_file_read(store_file *file, uint64_t offset, void *buffer, size_t size);

/* --- store_write.c ---------------------------------------------------------------------------------------
 */

/* Creation properties of an object without times in it, so that equal input gives equal bytes. */
hid_t store_untimed(hid_t class_id);

/* Makes the groups of an absolute path that are missing: all of them (whole) or all but the last name. */
lam_status store_make_groups(store *s, const char *name, bool whole, lam_error *error);

/* Writes an array of which no checksum is kept. */
lam_status store_write_plain(store *s, const char *name, hid_t type, int rank, const size_t *dims,
                             const void *data, lam_error *error);

/* --- store_attribute.c -------------------------------------------------------------------------------------
 */

/* The type of texts of width bytes: UTF-8, zero padded. The caller closes it. */
lam_status store_text_type(store *s, size_t width, hid_t *out, lam_error *error);

/* The HDF5 type of values; the caller closes it. Negative when HDF5 fails. */
hid_t store_file_type(store_type type);

/* --- store_read.c ----------------------------------------------------------------------------------------
 */

/* An array of the file, its place and size compared with the file. */
typedef struct store_array {
    hid_t id;
    bool is_text;
    store_type type;   /* unless is_text */
    size_t value_size; /* bytes of a value or a text */
    int rank;
    size_t dims[STORE_MAX_RANK];
    size_t bytes;
    uint64_t offset; /* in the file; 0 when bytes is 0 */
} store_array;

/* Opens an array; the caller closes it, also after an error. LAM_ERR_FORMAT when missing or not ours. */
lam_status store_array_open(store *s, const char *name, store_array *array, lam_error *error);
void store_array_close(store_array *array);

/* The same for one that must be of this type and shape; a dimension of SIZE_MAX stands for any. */
lam_status store_array_open_as(store *s, const char *name, store_type type, int rank, const size_t *dims,
                               store_array *array, lam_error *error);

/* --- store_checksum.c --------------------------------------------------------------------------------------
 */

/* Hashes a dataset that is about to be written and keeps the result. */
lam_status store_sums_add(store_sums *sums, const char *name, const void *data, size_t bytes,
                          lam_error *error);
void store_sums_free(store_sums *sums);
const store_sum *store_sums_find(const store_sums *sums, const char *name);

/* The checksums of an array, as many as it has pieces; else NULL and LAM_ERR_DAMAGED in error. */
const store_sum *store_sums_find_for(const store *s, const char *name, const store_array *array,
                                     lam_error *error);

/* Writes /checksum; reads it and compares it with its own checksum. */
lam_status store_sums_write(store *s, lam_error *error);
lam_status store_sums_read(store *s, lam_error *error);

/* Reads an array into data (NULL: only to look at it) and compares it with its checksums. */
lam_status store_array_load(store *s, const char *name, const store_array *array, void *data,
                            lam_error *error);

#endif
