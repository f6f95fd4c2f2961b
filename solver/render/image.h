/* An 8-bit picture in memory, and its PNG file: the only file that writes with libpng. */
#ifndef LAMBERT_RENDER_IMAGE_H
#define LAMBERT_RENDER_IMAGE_H

#include "store/status.h"

#include <stdint.h>

#define IMAGE_MAX_SIDE 16384
#define IMAGE_MAX_PIXELS ((size_t)64 << 20)

typedef struct image {
    size_t width, height;
    size_t channels; /* 1: grey, 3: red, green, blue; sRGB */
    uint8_t *pixels; /* [height][width][channels], top row first */
} image;

/* LAM_ERR_ARGUMENT for a side or a number of pixels beyond the limits. */
lam_status image_check_size(size_t width, size_t height, lam_error *error);

/* Makes a black picture; freed with image_free. Errors: LAM_ERR_ARGUMENT (a size), LAM_ERR_MEMORY. */
lam_status image_create(size_t width, size_t height, size_t channels, image *picture, lam_error *error);
void image_free(image *picture);

/* Makes the bytes of a PNG of 16 bits a channel, 1 or 3 channels, values [height][width][channels], without a
 * word about colours; *bytes is freed with free(). Errors: LAM_ERR_MEMORY. */
lam_status image_encode_deep(size_t width, size_t height, size_t channels, const uint16_t *values,
                             unsigned char **bytes, size_t *length, lam_error *error);

/* Writes a PNG beside path and renames it onto path, so that an older file stays whole until then.
 * Errors: LAM_ERR_IO naming path (also for a full disk), LAM_ERR_MEMORY. */
lam_status image_write_png(const image *picture, const char *path, lam_error *error);

#endif
