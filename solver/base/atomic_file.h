/* Files that appear whole or not at all: written beside their name, flushed, renamed. */
#ifndef LAMBERT_BASE_ATOMIC_FILE_H
#define LAMBERT_BASE_ATOMIC_FILE_H

#include "store/status.h"

#include <stdio.h>

typedef struct output_file {
    char *path;
    char *partial;
    FILE *stream;
} output_file;

/* Whether path can be written: its directory exists and is writable, and it is no directory itself. Asked
 * before long work. Errors: LAM_ERR_IO. */
lam_status output_file_check(const char *path, lam_error *error);

/* Opens a hidden file beside path; a zeroed output_file is what output_file_abort may be called on. */
lam_status output_file_open(const char *path, output_file *out, lam_error *error);

/* Flushes to the disk and renames onto path; on an error (a full disk) nothing is left behind. */
lam_status output_file_commit(output_file *out, lam_error *error);

/* Removes what was written; does nothing after a commit. */
void output_file_abort(output_file *out);

/* The last extension of a path in lower case without its dot ("npy"), "" when there is none. */
void output_file_extension(const char *path, char extension[16]);

#endif
