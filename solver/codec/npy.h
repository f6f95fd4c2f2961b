/* Arrays as NPY answers (little-endian, C order, format 1.0). No I/O. Reading them: request.h. */
#ifndef LAMBERT_CODEC_NPY_H
#define LAMBERT_CODEC_NPY_H

#include "solver/codec/buffer.h"

#include <stdint.h>

/* Integers have a header alone: their values are appended as they are in memory. */
typedef enum npy_type { NPY_F2, NPY_F4, NPY_F8, NPY_U4, NPY_I4 } npy_type;

/* Appends the header of an array of this shape, at most NPY_HEADER_MOST bytes; false when memory is short. */
#define NPY_HEADER_MOST 192
bool npy_write_header(buffer *b, npy_type type, size_t rank, const size_t *shape);

/* Bytes of a number. */
size_t npy_size(npy_type type);

/* Writes values[0..count) as floating-point numbers of this type. NPY_F2 may be written over the values. */
void npy_convert(npy_type type, const float *values, size_t count, char *to);

/* Appends values[0..count). */
bool npy_write_values(buffer *b, npy_type type, const float *values, size_t count);

/* The same of doubles, of which *rounding becomes the largest that a value was rounded by, if that is more
 * than it was. */
bool npy_write_doubles(buffer *b, npy_type type, const double *values, size_t count, double *rounding);

#endif
