/* A folder where long work keeps what it has finished, so that the same command goes on there. It belongs to
 * one run at a time. Knows file names, not what is in the files. */
#ifndef LAMBERT_FORMFACTOR_SCRATCH_H
#define LAMBERT_FORMFACTOR_SCRATCH_H

#include "store/large_file.h"

#include <stdint.h>

typedef struct scratch scratch;

/* Takes a folder, which is made where it is missing (not its parents). LAM_ERR_IO names it: another run has
 * it, or it cannot be written to. */
lam_status scratch_open(const char *folder, scratch **out, lam_error *error);

/* The path of a file in it, for messages, and the file opened for reading and writing, made where it is
 * missing. The caller closes fd and frees path with free. */
lam_status scratch_file(scratch *s, const char *name, int *fd, char **path, lam_error *error);

/* The folder as a place for arrays that memory is too small for; they do not outlast the run. Owned by s. */
const large_place *scratch_place(const scratch *s);

/* Bytes that its files have already, and those that they can have: with what is free; UINT64_MAX when that is
 * unknown. */
uint64_t scratch_used_bytes(const scratch *s);
uint64_t scratch_free_bytes(const scratch *s);

/* Lets go of the folder. With done set the files opened through it are removed, else they stay for the next
 * run. A folder that scratch_open made is removed where it is empty. NULL is allowed. */
void scratch_close(scratch *s, bool done);

#endif
