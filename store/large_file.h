/* An array in an unnamed, mapped file, for arrays larger than memory: the system keeps as much of it in
 * memory as fits and writes the rest to the disk. */
#ifndef LAMBERT_STORE_LARGE_FILE_H
#define LAMBERT_STORE_LARGE_FILE_H

#include "store/status.h"

/* The folder of these files: its open descriptor, and its name for messages. Nothing else creates files in it
 * meanwhile. */
typedef struct large_place {
    int folder;
    const char *name;
} large_place;

typedef struct large_file large_file;

/* Creates an empty array. place must outlive it. Errors: LAM_ERR_IO names the folder, LAM_ERR_MEMORY. */
lam_status large_file_create(const large_place *place, large_file **out, lam_error *error);

/* Resizes the array to n_bytes, at *bytes from now on, and reserves them on the disk, so that no later write
 * can fail. Contents stay; new bytes are zero. The file disappears when it is freed or the process ends in
 * any way. Errors: LAM_ERR_IO (also a full disk), LAM_ERR_MEMORY; the file is then unchanged. */
lam_status large_file_resize(large_file *f, size_t n_bytes, void **bytes, lam_error *error);

/* NULL is allowed. */
void large_file_free(large_file *f);

#endif
