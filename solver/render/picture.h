/* Draws a picture: shades the elements behind its pixels and maps values to colours. The bits are the same
 * for any number of threads. */
#ifndef LAMBERT_RENDER_PICTURE_H
#define LAMBERT_RENDER_PICTURE_H

#include "solver/render/image.h"
#include "solver/render/palette.h"
#include "solver/render/raster.h"
#include "solver/render/shade.h"
#include "solver/render/tone.h"

/* The mapping of values to colours: exposure and tone curve; with a scale, its false colours; with plain, the
 * values themselves, display-linear from 0 to 1. Of a smooth view with a scale, iso_lines lines are drawn at
 * equal steps from low, the last at high; nodes are those of the view then, else NULL. */
typedef struct picture_options {
    double exposure;
    color_scale scale;
    bool plain;
    size_t iso_lines;
    const smooth_nodes *nodes;
} picture_options;

/* The luminances that exposure is found from, of one picture or of a sequence; starts as zero. */
typedef struct picture_light {
    tone_histogram reflected; /* without elements that glow */
    tone_histogram all;
} picture_light;

/* The coarse picture of the same camera that luminances are measured on. */
raster_view picture_coarse(const raster_view *view);

/* Adds the luminances of a coarse picture. glows [n]: elements that mostly emit, which do not affect the
 * exposure unless there are no others. */
void picture_measure(const raster *coarse, const shade *light, const bool *glows, picture_light *sum);

/* Adds the luminances of other pictures. */
void picture_light_add(picture_light *sum, const picture_light *other);

/* The luminances that count. */
const tone_histogram *picture_light_shown(const picture_light *sum);

/* Draws from elements that were found before, by the calling thread alone. picture has been created, with 1
 * channel or 3 (needed for colour), and its view stands at the left; a legend may take the other columns.
 * Errors: LAM_ERR_MEMORY, only of iso-lines. */
lam_status picture_fill(const raster *r, const shade *light, const picture_options *how, image *picture,
                        lam_error *error);

/* The same picture in one go, by all threads, without memory for its elements. Errors: LAM_ERR_CANCELLED,
 * LAM_ERR_MEMORY. */
lam_status picture_draw(const raster_view *view, const shade *light, const picture_options *how,
                        const progress *waiting, image *picture, lam_error *error);

/* Linear values in place of colours: the mean over a pixel's rays, 0 of the background. */
typedef struct picture_values {
    size_t width, height, channels;
    float *values; /* [height][width][channels], top row first */
} picture_values;

/* Freed by picture_values_free. Errors: LAM_ERR_ARGUMENT (a size), LAM_ERR_MEMORY. */
lam_status picture_values_create(size_t width, size_t height, size_t channels, picture_values *out,
                                 lam_error *error);
void picture_values_free(picture_values *v);

/* As picture_fill and picture_draw, into values of the size of the view and the channels of the light. */
void picture_values_fill(const raster *r, const shade *light, picture_values *out);
lam_status picture_values_draw(const raster_view *view, const shade *light, const progress *waiting,
                               picture_values *out, lam_error *error);

/* The columns that a legend takes at the right of a picture; 0 where the picture is too small for one. */
size_t picture_legend_width(size_t width, size_t height);

/* Draws a bar of the scale there, with its numbers and, above, their unit: "" or letters of W/m2, klx, fc,
 * lm/ft2, 1000. Other characters leave a gap. */
void picture_legend(const color_scale *scale, const char *unit, image *picture);

#endif
