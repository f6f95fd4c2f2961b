/* From a camera to pixels: casts rays, shades what they meet. Same bits for any number of threads. */
#ifndef LAMBERT_RENDER_PICTURE_H
#define LAMBERT_RENDER_PICTURE_H

#include "solver/render/camera.h"
#include "solver/render/image.h"
#include "solver/render/shade.h"
#include "solver/render/tone.h"

/* What is looked at. All of it is only read. */
typedef struct picture_scene {
    const mesh *mesh;
    const visibility *visibility;
    const shade *shade;
    const bool *glows; /* [n]: elements whose light is mostly their own; they do not set the exposure */
} picture_scene;

/* How values become colours: exposed and toned, or, with range > 0, false colour from 0 to range, or, with
 * plain, as they are: display-linear from 0 to 1. */
typedef struct picture_options {
    double exposure;
    double range;
    bool plain;
    size_t width; /* columns drawn on, from the left; a legend takes the others */
} picture_options;

/* Gathers what a coarse picture of this camera and aspect shows, without what glows by itself
 * (with it where there is nothing else). */
void picture_measure(const picture_scene *scene, const camera *c, tone_histogram *h);

/* Draws; picture has been created, with 1 channel or 3 (needed for colour). Errors: LAM_ERR_CANCELLED. */
lam_status picture_draw(const picture_scene *scene, const camera *c, const picture_options *how,
                        const progress *waiting, image *picture, lam_error *error);

/* The columns that a legend takes at the right of a picture; 0 where the picture is too small for one. */
size_t picture_legend_width(size_t width, size_t height);

/* Draws a bar of the false colours there, with the numbers of its ends and quarters. */
void picture_legend(double range, image *picture);

#endif
