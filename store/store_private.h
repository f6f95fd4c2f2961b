/* Declarations shared by the files of store/: the open file, its table of checksums, the index of one that is
 * read. No other header includes <hdf5.h>. A store that is read never calls HDF5 in this process. */
#ifndef LAMBERT_STORE_STORE_PRIVATE_H
#define LAMBERT_STORE_STORE_PRIVATE_H

#include "store/confined.h"
#include "store/status.h"
#include "store/store.h"
#include "store/store_map.h"
#include "store/store_reply.h"

#include <hdf5.h>

/* Values are written and hashed in their byte order in memory. */
_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "stores are little-endian");

#define STORE_FORMAT "lambert"
#define STORE_PIECE ((size_t)1 << 20)     /* bytes under one checksum */
#define STORE_TEXT_MOST ((size_t)1 << 20) /* bytes of a text in an array */
#define STORE_NAME_SIZE 256               /* longest HDF5 path here, its NUL included */
#define STORE_MAX_DEPTH 8                 /* groups within groups */

/* The file below HDF5 (store_driver.c). */
typedef struct store_file {
    int fd;
    bool writable;
    int error;     /* errno of the first failed access; from then on writes are dropped */
    uint64_t size; /* of the file; while writing, dropped writes included */
    hid_t driver;  /* our reference to its driver; negative: none */
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

/* An array of the file; its offset and size were compared with the size of the file. */
typedef struct store_array {
    bool is_text;
    store_type type;   /* unless is_text */
    size_t value_size; /* bytes of a value or a text */
    int rank;
    size_t dims[STORE_MAX_RANK];
    size_t bytes;
    uint64_t offset; /* in the file; 0 when bytes is 0 */
} store_array;

typedef struct store_attribute {
    attribute_kind kind;
    const char *name, *text;
    double number; /* an integer's value also stands here */
    int64_t integer;
} store_attribute;

typedef struct store_object {
    object_kind kind;
    const char *name;
    store_array array;
    lam_status status; /* of OBJECT_FAULTY */
    const char *fault;
    const store_attribute *attributes; /* sorted by name */
    size_t n_attributes;
} store_object;

/* Everything in an opened store but its data. */
typedef struct store_index {
    char *bytes; /* names and texts point into them */
    size_t n_objects, n_attributes;
    store_object *objects; /* sorted by name */
    store_attribute *attributes;
} store_index;

struct store {
    char *path;    /* as given */
    char *target;  /* final path of partial; NULL when reading */
    char *partial; /* NULL when reading */
    bool broken;   /* a call failed while writing: cannot be sealed */
    store_file file;
    hid_t h5;          /* of a file that is written; negative: none */
    store_index index; /* of an opened file */
    store_sums sums;
    store_identity identity; /* of an opened file */
    store_map *map;          /* of an opened file, held; NULL: none */
    const stop_check *stop;  /* of an opened file; NULL: what reads it is never left */
    uint64_t memory;         /* bytes that its checksums may take */
};

/* Mutes the error printing of HDF5 while one of our functions runs, and restores it then. */
typedef struct store_mute {
    H5E_auto2_t print;
    void *context;
} store_mute;
store_mute store_mute_begin(void);
void store_mute_end(const store_mute *mute);

/* LAM_ERR_ARGUMENT unless name is an absolute path that a store may use. */
lam_status store_name_check(const store *s, const char *name, lam_error *error);

/* Turns a failed HDF5 call into a status and a message; call it before any other HDF5 function.
 * what: the verb, "write", "read". */
lam_status store_hdf5_failure(store *s, const char *name, const char *what, lam_error *error);

/* Memory for a store of this path, with no file yet. */
lam_status store_new(const char *path, store **out, lam_error *error);

/* Reads the headers of the file at s->file.fd by HDF5 and sends them (store_reply.h); a child process calls
 * it. */
void store_headers_send(store *s, int to);

/* store_open by a child that runs `run` on the store, with these limits: tests send what they like. */
lam_status store_open_by(const char *path, confined_main *run, const confined_limits *limits, store **out,
                         lam_error *error);

/* LAM_ERR_DAMAGED unless a reply may begin so: then head->bytes more of it are worth the memory. */
lam_status store_reply_check(const reply_head *head, const char *path, lam_error *error);

/* Turns the bytes behind a head into an index of a file of this size. Takes bytes over, of malloc, also where
 * it fails. Errors: LAM_ERR_DAMAGED for nonsense, LAM_ERR_FORMAT for arrays that share bytes, LAM_ERR_MEMORY.
 */
lam_status store_reply_read(const reply_head *head, const char *path, uint64_t file_size, char *bytes,
                            store_index *out, lam_error *error);
void store_index_free(store_index *index);

/* A group or an array of an opened store; NULL: none has this name. */
const store_object *store_find(const store *s, const char *name);
const store_attribute *store_attribute_find(const store_object *object, const char *name);

/* File access properties that use `file`, which must outlive the HDF5 file; negative on failure. The driver
 * stays registered until store_driver_release. */
hid_t store_driver_properties(store_file *file);

/* Gives the driver back, behind H5Fclose alone: HDF5 1.10 gives up the file's reference to the driver before
 * it calls the driver's close, so that the last reference must not be the file's. */
void store_driver_release(store_file *file);

/* Reads exactly size bytes at offset; false with file->error set, EIO if the file is shorter. */
bool store_file_read(store_file *file, uint64_t offset, void *buffer, size_t size);

/* Creation properties of an object without times in it, so that equal input gives equal bytes. */
hid_t store_untimed(hid_t class_id);

/* Creates the missing groups of an absolute path: all of them (whole) or all but the last name. */
lam_status store_make_groups(store *s, const char *name, bool whole, lam_error *error);

/* Writes an array without a checksum. */
lam_status store_write_plain(store *s, const char *name, hid_t type, int rank, const size_t *dims,
                             const void *data, lam_error *error);

/* The type of texts of width bytes: UTF-8, zero padded. The caller closes it. */
lam_status store_text_type(store *s, size_t width, hid_t *out, lam_error *error);

/* The HDF5 type of values; the caller closes it. Negative when HDF5 fails. */
hid_t store_file_type(store_type type);

/* An array of an opened store. LAM_ERR_FORMAT if it is missing or of an unknown type. */
lam_status store_array_find(const store *s, const char *name, const store_array **array, lam_error *error);

/* The same for an array that must have this type and shape; a dimension of SIZE_MAX matches any. */
lam_status store_array_find_as(const store *s, const char *name, store_type type, int rank,
                               const size_t *dims, const store_array **array, lam_error *error);

/* Adds the checksums of a dataset that is about to be written. */
lam_status store_sums_add(store_sums *sums, const char *name, const void *data, size_t bytes,
                          lam_error *error);
void store_sums_free(store_sums *sums);
const store_sum *store_sums_find(const store_sums *sums, const char *name);

/* The checksums of an array, one for each piece; NULL, with LAM_ERR_DAMAGED in error, if there are others. */
const store_sum *store_sums_find_for(const store *s, const char *name, const store_array *array,
                                     lam_error *error);

/* Writes /checksum; reads it, of an opened store, and compares it with its own checksum. */
lam_status store_sums_write(store *s, lam_error *error);
lam_status store_sums_read(store *s, lam_error *error);

/* Reads exactly that many bytes of the file, of the array `name`. Errors: LAM_ERR_IO. */
lam_status store_data_read(store *s, const char *name, uint64_t offset, void *data, size_t bytes,
                           lam_error *error);

/* The byte of a mapped file at an offset within it. */
const void *store_map_at(const store_map *map, uint64_t offset);

/* Reads an array into data (NULL: nowhere, or in the mapping) and compares it with its checksums.
 * LAM_ERR_CANCELLED where the store's `stop` says so. */
lam_status store_array_load(store *s, const char *name, const store_array *array, void *data,
                            lam_error *error);

#endif
