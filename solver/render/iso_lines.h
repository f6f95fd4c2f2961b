/* Lines of equal value on the surfaces of a picture. */
#ifndef LAMBERT_RENDER_ISO_LINES_H
#define LAMBERT_RENDER_ISO_LINES_H

#include "solver/render/image.h"
#include "solver/render/palette.h"
#include "solver/render/raster.h"
#include "solver/render/shade.h"

/* The values that lines are found from: in each pixel the element with most of its rays, VISIBILITY_NOTHING
 * for the background, and the place on the scale of its luminance there. */
typedef struct iso_field {
    size_t width, height;
    float *place;      /* [height][width] */
    uint32_t *element; /* [height][width] */
} iso_field;

/* Freed by iso_field_free. Errors: LAM_ERR_MEMORY. */
lam_status iso_field_create(size_t width, size_t height, iso_field *out, lam_error *error);
void iso_field_free(iso_field *f);

/* Fills the pixels of a tile. */
void iso_field_tile(const raster_tile *tile, const shade *light, const color_scale *scale, iso_field *f);

/* Draws n lines, at the places k / n for k = 1 ... n as the viewer of the daemon does, about 1.2 pixels wide,
 * over a picture of 3 channels whose view stands at the left. A line is |place - k / n| < .6 |gradient|, with
 * the gradient a pixel by differences between pixels side by side whose elements have a node in common: so
 * lines end at creases, at the borders of groups and at silhouettes, where light jumps. Cost: O(pixels). */
void iso_lines_draw(const iso_field *f, const smooth_nodes *nodes, size_t n, image *picture);

#endif
