/* The scratch folder of a long run, which the same command continues from. It is locked by one run at a time.
 * Knows file names, not the contents of files. */
#ifndef LAMBERT_FORMFACTOR_SCRATCH_H
#define LAMBERT_FORMFACTOR_SCRATCH_H

#include "store/large_file.h"

#include <stdint.h>

typedef struct scratch scratch;

/* Locks a folder, and makes it where it is missing (not its parents). LAM_ERR_IO names the folder: another
 * run holds it, or it cannot be written to. */
lam_status scratch_open(const char *folder, scratch **out, lam_error *error);

/* Opens a file of the folder for reading and writing, and makes it where it is missing; path is for messages.
 * The caller closes fd and frees path with free. */
lam_status scratch_file(scratch *s, const char *name, int *fd, char **path, lam_error *error);

/* The folder as a place for arrays that exceed memory; they do not outlast the run. Owned by s. */
const large_place *scratch_place(const scratch *s);

/* The bytes of its files, and the bytes that these can grow to: the same plus the free space, or UINT64_MAX
 * where that is unknown. */
uint64_t scratch_used_bytes(const scratch *s);
uint64_t scratch_free_bytes(const scratch *s);

/* Unlocks the folder. With done, the files opened through it are removed; else they stay for the next run. A
 * folder that scratch_open made is removed where it is empty. NULL is allowed. */
void scratch_close(scratch *s, bool done);

#endif
