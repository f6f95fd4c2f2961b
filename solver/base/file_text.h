/* A whole file as bytes in memory. */
#ifndef LAMBERT_BASE_FILE_TEXT_H
#define LAMBERT_BASE_FILE_TEXT_H

#include "store/status.h"

#include <stddef.h>

/* Reads the whole of a file or a pipe, and puts a NUL behind its *out_length bytes; the caller frees *out. A
 * regular file is allocated at once, so that the peak is its size. Errors: LAM_ERR_IO, LAM_ERR_MEMORY; each
 * names the file. */
lam_status file_text(const char *path, char **out, size_t *out_length, lam_error *error);

#endif
