/* The scene, the camera and the shading of a picture, for `lambert render` of one picture and of many. */
#ifndef LAMBERT_VERBS_RENDER_VIEW_H
#define LAMBERT_VERBS_RENDER_VIEW_H

#include "solver/render/exr.h"
#include "solver/render/picture.h"
#include "solver/verbs/render_options.h"

/* A store and how it is looked at. */
typedef struct render_view {
    store *s;
    mesh m;
    visibility *seen;
    smooth_nodes nodes; /* of smooth pictures */
    camera camera;
    raster_view pixels;
    bool exr; /* for an EXR, which has all channels; else the first 3 are drawn */
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

/* The exposure, or the scale of colours, that fits the light. nodes: those of the view. */
picture_options render_style(const render_options *f, const picture_light *light, const smooth_nodes *nodes);

/* The scale of colours from 0, or with --log from three decades below, to high, where the options have none.
 */
color_scale render_scale(const render_options *f, double high);

/* The next larger number whose quarters have few digits, for a legend. */
double render_round_up(double x);

/* The sheet that a picture is drawn on: colours, or the values of an EXR. */
typedef struct render_sheet {
    image picture;
    picture_values values;
} render_sheet;

/* A sheet without light of the size that is asked for; freed by render_sheet_free, also after an error. */
lam_status render_sheet_create(const render_options *f, const picture_options *style, size_t n_channels,
                               render_sheet *out, lam_error *error);
void render_sheet_free(render_sheet *sheet);

/* Writes the file, with the unit of its light and the legend of a scale. *clamped: as exr_write says, else 0.
 */
lam_status render_sheet_write(const render_options *f, const picture_options *style, const char *unit,
                              render_sheet *sheet, const char *path, size_t *clamped, lam_error *error);

/* Says that values were beyond those of an EXR, where any were. */
void render_log_clamped(size_t clamped, terminal *t);

/* Says where the camera stands, as --camera reads it, and what the brightness means. */
void render_log_camera(const camera *c, terminal *t);
void render_log_style(const render_options *f, const picture_options *style, const char *unit, terminal *t);

/* The unit of the light that is drawn. */
const char *render_unit(const render_options *f, const lit_store *lit);

#endif
