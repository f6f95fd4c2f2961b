/* Draws a picture: casts the rays of a camera, shades the elements they hit and maps values to colours. The
 * bits are the same for any number of threads. */
#ifndef LAMBERT_RENDER_PICTURE_H
#define LAMBERT_RENDER_PICTURE_H

#include "solver/render/camera.h"
#include "solver/render/image.h"
#include "solver/render/shade.h"
#include "solver/render/tone.h"

/* The scene to draw; only read. */
typedef struct picture_scene {
    const mesh *mesh;
    const visibility *visibility;
    const shade *shade;
    const bool *glows; /* [n]: elements that mostly emit; they do not affect the exposure */
} picture_scene;

/* The mapping of values to colours: exposure and tone curve; with range > 0, false colour from 0 to range;
 * with plain, the values themselves, display-linear from 0 to 1. */
typedef struct picture_options {
    double exposure;
    double range;
    bool plain;
    size_t width; /* columns of the picture proper, from the left; a legend takes the others */
} picture_options;

/* Adds the luminances of a coarse picture of this camera to h, without elements that glow unless there are no
 * others. */
void picture_measure(const picture_scene *scene, const camera *c, tone_histogram *h);

/* Draws; picture has been created, with 1 channel or 3 (needed for colour). Errors: LAM_ERR_CANCELLED. */
lam_status picture_draw(const picture_scene *scene, const camera *c, const picture_options *how,
                        const progress *waiting, image *picture, lam_error *error);

/* The columns that a legend takes at the right of a picture; 0 where the picture is too small for one. */
size_t picture_legend_width(size_t width, size_t height);

/* Draws a bar of the false colours there, with the numbers of its ends and quarters. */
void picture_legend(double range, image *picture);

#endif
