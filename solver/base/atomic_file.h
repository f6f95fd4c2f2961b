/* Files that appear whole or not at all: each is written to a hidden file in its folder, flushed to the disk,
 * and renamed. */
#ifndef LAMBERT_BASE_ATOMIC_FILE_H
#define LAMBERT_BASE_ATOMIC_FILE_H

#include "store/status.h"

#include <stdio.h>

typedef struct atomic_file {
    char *path;
    char *partial;
    FILE *stream;
} atomic_file;

/* LAM_ERR_IO unless the directory of path exists and is writable and path itself is not a directory. For a
 * check before long work. */
lam_status atomic_file_check(const char *path, lam_error *error);

/* Opens a hidden file beside path. */
lam_status atomic_file_open(const char *path, atomic_file *out, lam_error *error);

/* Flushes to the disk and renames onto path; on an error (a full disk) no file is left behind. */
lam_status atomic_file_commit(atomic_file *out, lam_error *error);

/* Removes the hidden file; does nothing after a commit, nor for a zeroed atomic_file. */
void atomic_file_abort(atomic_file *out);

/* The last extension of a path in lower case without its dot ("npy"), "" when there is none. */
void atomic_file_extension(const char *path, char extension[16]);

#endif
