/* A store file: named typed arrays and attributes in HDF5, sealed once, then read only.
 * The only user of <hdf5.h>; knows no operator kind. Names are HDF5 paths (/mesh/area).
 * Each function that reads asks for a store that was opened, each that writes for one that was created. One
 * thread at a time may call into a store; several may open and read stores, as HDF5 only runs in children
 * then, but not while another thread writes one, as a child would begin in the middle of a call of HDF5. */
#ifndef LAMBERT_STORE_STORE_H
#define LAMBERT_STORE_STORE_H

#include "lambert/lambert.h"
#include "store/stop.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define STORE_VERSION 1
#define STORE_MAX_RANK 4

typedef struct store store;

/* f16: IEEE half precision. */
typedef enum store_type {
    STORE_F32,
    STORE_F64,
    STORE_U32,
    STORE_U64,
    STORE_F16,
    STORE_U16,
    STORE_I8
} store_type;

/* Bytes of one value of a type. */
size_t store_type_size(store_type type);

/* XXH3 with 64 bits and seed 0: the checksum of every array, and of files beside a store. */
uint64_t store_checksum(const void *data, size_t bytes);

/* Starts a store that will become path, as a hidden partial file beside it, created exclusively. Groups are
 * created as arrays and attributes name them. Errors: LAM_ERR_IO (names path), LAM_ERR_MEMORY. */
lam_status store_create(const char *path, store **out, lam_error *error);

/* Writes one whole array, row-major, contiguous and aligned; rank 1 to STORE_MAX_RANK. A dimension may be 0.
 */
lam_status store_write(store *s, const char *name, store_type type, int rank, const size_t *dims,
                       const void *data, lam_error *error);

/* Writes an array of UTF-8 texts (fixed length, zero padded). */
lam_status store_write_texts(store *s, const char *name, size_t count, const char *const *texts,
                             lam_error *error);

/* Sets an attribute of the group or dataset `object` ("/" for the root); creates a missing group. */
lam_status store_set_text(store *s, const char *object, const char *name, const char *text, lam_error *error);
lam_status store_set_number(store *s, const char *object, const char *name, double value, lam_error *error);
lam_status store_set_integer(store *s, const char *object, const char *name, int64_t value, lam_error *error);

/* True where a copy is to lack an object (attribute NULL; a group then also lacks all that is in it), or an
 * attribute. */
typedef bool store_skip(const char *object, const char *attribute);

/* Copies the arrays and attributes of an opened store into one that is written, but for those that sealing
 * adds and those to skip. Each array is compared with its checksums, and is in memory once. Errors: as
 * store_read and store_write. */
lam_status store_copy(store *from, store_skip *skip, store *to, lam_error *error);

/* Adds format, version, created and /checksum, flushes to the disk, renames onto path (replacing an older
 * file as a whole) and frees s in any case; after an error no file is left behind. Errors: LAM_ERR_IO (also a
 * full disk; names path). */
lam_status store_seal(store *s, lam_error *error);

/* Abandons a store being written, or closes one that was opened; NULL is allowed. */
void store_close(store *s);

/* Opens read only and checks that it is a sealed store of this version. The file is opened once. Headers that
 * are not exactly as this library writes them, or damaged, are read by a child process (some ms, more for a
 * process with much memory of its own), at most 30 s.
 * Errors: LAM_ERR_IO (also where no child can be started, or SIGCHLD is ignored), LAM_ERR_FORMAT (foreign or
 * truncated), LAM_ERR_VERSION, LAM_ERR_DAMAGED (also where HDF5 crashes or does not end), LAM_ERR_MEMORY. */
lam_status store_open(const char *path, store **out, lam_error *error);

/* The same within so many bytes of memory for checksums, beside names and attributes (at most 64 MiB); and
 * this and everything that reads arrays of the store later is left once `stop` says so (LAM_ERR_CANCELLED):
 * it is asked at least every 50 ms while headers are waited for, and before each MiB of an array. stop may be
 * NULL; it outlives the store. */
lam_status store_open_within(const char *path, uint64_t memory, const stop_check *stop, store **out,
                             lam_error *error);

/* Reads every dataset and compares it with /checksum; LAM_ERR_DAMAGED names the dataset and its MiB. */
lam_status store_verify(store *s, lam_error *error);

/* The same for the datasets below a group. */
lam_status store_verify_group(store *s, const char *group, lam_error *error);

/* Identifies a store: its file, and the checksum of its checksums. */
typedef struct store_identity {
    uint64_t device, inode, size;
    int64_t modified_s, modified_ns;
    char digest[17]; /* 16 hex digits: the attribute xxh3 of /checksum */
} store_identity;
bool store_identity_same(const store_identity *a, const store_identity *b);

/* The identity of an opened store. */
const store_identity *store_identity_of(const store *s);

/* The path it was opened or created with; owned by s. */
const char *store_path(const store *s);

/* True if there is a group or dataset of this name. */
bool store_has(store *s, const char *name);

/* Type and shape of an array. LAM_ERR_FORMAT if it is missing or of another type than store_type has. */
lam_status store_array_info(store *s, const char *name, store_type *type, int *rank, size_t *dims,
                            lam_error *error);

/* Reads a whole array into new memory (*data, freed by the caller with free) and compares it with its
 * checksums. It must have this type, rank and dims; a dim of SIZE_MAX is replaced by the one found. Sizes are
 * compared with the size of the file before anything is allocated. Errors: LAM_ERR_FORMAT, LAM_ERR_DAMAGED,
 * LAM_ERR_MEMORY; each names the path and the dataset. */
lam_status store_read(store *s, const char *name, store_type type, int rank, size_t *dims, void **data,
                      lam_error *error);

/* The same into memory of the caller, for an array of this type and dims, none of them SIZE_MAX. */
lam_status store_read_into(store *s, const char *name, store_type type, int rank, const size_t *dims,
                           void *data, lam_error *error);

/* Reads texts into one block: *texts is an array of *count pointers, freed by the caller with one free(). */
lam_status store_read_texts(store *s, const char *name, size_t *count, char ***texts, lam_error *error);

/* Attributes; LAM_ERR_FORMAT if missing or of another type. A text is freed by the caller. */
lam_status store_get_text(store *s, const char *object, const char *name, char **text, lam_error *error);
lam_status store_get_number(store *s, const char *object, const char *name, double *value, lam_error *error);
lam_status store_get_integer(store *s, const char *object, const char *name, int64_t *value,
                             lam_error *error);
bool store_has_attribute(store *s, const char *object, const char *name);

/* Calls visit for every attribute of object, sorted by name: text is NULL for a number. */
typedef void store_visit(void *context, const char *name, const char *text, double number);
lam_status store_each_attribute(store *s, const char *object, store_visit *visit, void *context,
                                lam_error *error);

/* Bytes of an array as stored, and of texts as store_read_texts gives them; 0: there is none. Nothing is
 * read.
 */
uint64_t store_array_bytes(const store *s, const char *name);
uint64_t store_texts_memory(const store *s, const char *name);

/* Bytes of all datasets below a group, as stored. */
lam_status store_group_bytes(store *s, const char *group, uint64_t *bytes, lam_error *error);

#endif
