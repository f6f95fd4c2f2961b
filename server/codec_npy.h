/* Arrays as NPY answers (little-endian, C order, format 1.0). No I/O. Reading them: codec_request.h. */
#ifndef LAMBERT_SERVER_CODEC_NPY_H
#define LAMBERT_SERVER_CODEC_NPY_H

#include "server/buffer.h"

#include <stdint.h>

typedef enum npy_type { NPY_F2, NPY_F4, NPY_F8 } npy_type;

/* Greatest value that half precision holds. */
#define NPY_HALF_MAX 65504.0f

/* Appends the header of an array of this shape; false when memory is short. */
bool npy_write_header(buffer *b, npy_type type, size_t rank, const size_t *shape);

/* Appends values[0..count), or values[index[i]] where index is not NULL. */
bool npy_write_values(buffer *b, npy_type type, const float *values, const uint32_t *index, size_t count);

/* The nearest half precision number, ties to even; beyond 65520: infinity. */
uint16_t npy_half(float value);

#endif
