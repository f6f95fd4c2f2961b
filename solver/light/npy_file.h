/* Arrays in NumPy's NPY files: little-endian floats in C order, nothing else. */
#ifndef LAMBERT_LIGHT_NPY_FILE_H
#define LAMBERT_LIGHT_NPY_FILE_H

#include "store/status.h"

#include <stdio.h>

#define NPY_MAX_RANK 3

typedef struct npy {
    int rank;
    size_t dims[NPY_MAX_RANK];
    double *values; /* row-major, freed by npy_free */
} npy;

void npy_free(npy *a);

/* Reads <f4 or <f8 of rank 1 to NPY_MAX_RANK. Sizes are compared with the file's before anything is
 * allocated. Errors: LAM_ERR_IO, LAM_ERR_FORMAT; each names the file. */
lam_status npy_read(const char *path, npy *out, lam_error *error);

/* Writes <f4; a failed write is seen by ferror(stream). */
void npy_write(FILE *stream, int rank, const size_t *dims, const float *values);

/* The same, <f8. */
void npy_write_double(FILE *stream, int rank, const size_t *dims, const double *values);

#endif
