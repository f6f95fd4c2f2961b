/* An array in a file without a name that is mapped into memory: for what is larger than that. The system
 * keeps as much of it in memory as there is room for and writes the rest to the disk. */
#ifndef LAMBERT_STORE_LARGE_FILE_H
#define LAMBERT_STORE_LARGE_FILE_H

#include "store/status.h"

/* The folder where such files lie: open, and its name for messages. Nobody else makes files in it meanwhile.
 */
typedef struct large_place {
    int folder;
    const char *name;
} large_place;

typedef struct large_file large_file;

/* An empty one. place must outlive it. Errors: LAM_ERR_IO names the folder, LAM_ERR_MEMORY. */
lam_status large_file_create(const large_place *place, large_file **out, lam_error *error);

/* Makes it so many bytes long, with room on the disk for all of them, so that no later write can fail for
 * want of it; keeps what is there, new bytes are zero. *bytes is where it lies now. The file goes when it is
 * freed, or the process ends in any way. Errors: LAM_ERR_IO (a full disk among them), LAM_ERR_MEMORY; the
 * file is then as it was. */
lam_status large_file_resize(large_file *f, size_t n_bytes, void **bytes, lam_error *error);

/* NULL is allowed. */
void large_file_free(large_file *f);

#endif
