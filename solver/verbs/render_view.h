/* The scene, the camera and the shading of a picture, for `lambert render` of one picture and of many. */
#ifndef LAMBERT_VERBS_RENDER_VIEW_H
#define LAMBERT_VERBS_RENDER_VIEW_H

#include "solver/render/picture.h"
#include "solver/verbs/light_options.h"

typedef struct render_camera {
    bool given;
    double eye[3], target[3], fov;
} render_camera;

typedef struct render_size {
    size_t width, height;
} render_size;

/* The command line of `lambert render`. */
typedef struct render_options {
    light_options light;
    const char *quantity;
    render_camera camera;
    render_size size;
    double exposure;
    bool false_color;
    bool smooth;
    double fps; /* of a video */
    const char *output;
} render_options;

/* A store and how it is looked at. */
typedef struct render_view {
    store *s;
    mesh m;
    visibility *seen;
    smooth_nodes nodes; /* of smooth pictures */
    camera camera;
    raster_view pixels;
} render_view;

/* Checks where the picture goes and loads the mesh, which is cheap. Freed by render_view_close, also after an
 * error; *v begins zeroed. */
lam_status render_view_open(const char *path, const render_options *f, render_view *v, lam_error *error);
void render_view_close(render_view *v);

/* Makes the view ready to draw: with the camera that is asked for, or one that shows the elements lit [n]. */
lam_status render_view_aim(const render_options *f, bool smooth, const bool *lit, render_view *v,
                           lam_error *error);

/* The light of elements in this view; freed by shade_destroy. E: its emission, or NULL. */
lam_status render_view_shade(const render_view *v, size_t n_channels, const float *values, const float *E,
                             shade **out, lam_error *error);

/* Marks the elements [n] that have any light. */
void render_mark_lit(const mesh *m, const float *values, bool *lit);

/* Marks the elements [n] whose own emission E, which may be NULL, is most of what they show. */
void render_mark_glowing(const mesh *m, const float *values, const float *E, bool *glows);

/* The exposure, or the range of colours, that fits the light. */
picture_options render_style(const render_options *f, const picture_light *light);

/* The next larger number whose quarters have few digits, for a legend. */
double render_round_up(double x);

/* A picture without light of the size that is asked for; freed by image_free. */
lam_status render_image(const render_options *f, const picture_options *style, size_t n_channels, image *out,
                        lam_error *error);

/* Says where the camera stands, as --camera reads it, and what the brightness means. */
void render_log_camera(const camera *c, terminal *t);
void render_log_style(const picture_options *style, terminal *t);

#endif
