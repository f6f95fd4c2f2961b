/* Draws a picture: shades the elements behind its pixels and maps values to colours. The bits are the same
 * for any number of threads. */
#ifndef LAMBERT_RENDER_PICTURE_H
#define LAMBERT_RENDER_PICTURE_H

#include "solver/render/image.h"
#include "solver/render/raster.h"
#include "solver/render/shade.h"
#include "solver/render/tone.h"

/* The mapping of values to colours: exposure and tone curve; with range > 0, false colour from 0 to range;
 * with plain, the values themselves, display-linear from 0 to 1. */
typedef struct picture_options {
    double exposure;
    double range;
    bool plain;
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
 * channel or 3 (needed for colour), and its view stands at the left; a legend may take the other columns. */
void picture_fill(const raster *r, const shade *light, const picture_options *how, image *picture);

/* The same picture in one go, by all threads, without memory for its elements. Errors: LAM_ERR_CANCELLED,
 * LAM_ERR_MEMORY. */
lam_status picture_draw(const raster_view *view, const shade *light, const picture_options *how,
                        const progress *waiting, image *picture, lam_error *error);

/* The columns that a legend takes at the right of a picture; 0 where the picture is too small for one. */
size_t picture_legend_width(size_t width, size_t height);

/* Draws a bar of the false colours there, with the numbers of its ends and quarters. */
void picture_legend(double range, image *picture);

#endif
