/* Image files, decoded in the child. Private to solver/scene/import. */
#ifndef LAMBERT_SCENE_IMPORT_IMAGES_H
#define LAMBERT_SCENE_IMPORT_IMAGES_H

#include "solver/scene/texture.h"

#include <stdbool.h>

/* The pixels of one image and of all together that are kept; larger ones are halved in both directions. */
#define IMAGE_PIXELS_MOST ((size_t)1 << 24)
#define IMAGES_PIXELS_MOST ((size_t)1 << 27)

/* Room for one phrase that says why an image is not read. */
enum { IMAGE_WHY = 160 };

/* Decodes a PNG, JPEG or WebP, known by its first bytes, to 8-bit RGB; alpha is left out, colours count as
 * sRGB whatever a profile says. False where it is damaged, cut off, of another type, or larger than 16,384
 * pixels along a side; then why says so. The caller frees out->pixels. */
bool image_decode(const unsigned char *bytes, size_t length, texture_image *out, char why[IMAGE_WHY]);

/* Halves an image in both directions, in place: means of four pixels in linear light. A last odd row or
 * column counts twice. */
void image_halve(texture_image *image);

/* True where no pixel has a colour. */
bool image_is_grey(const texture_image *image);

#endif
