#include "solver/verbs/render_view.h"

#include "solver/base/atomic_file.h"

#include <math.h>
#include <stdlib.h>

static float luminance_of(const mesh *m, const float *values, size_t i) {
    float channels[3] = {0, 0, 0};
    for (size_t c = 0; c < m->n_channels && c < 3; c++) channels[c] = values[c * m->n + i];
    return tone_luminance(channels, m->n_channels);
}

void render_mark_lit(const mesh *m, const float *values, bool *lit) {
    float largest = 0;
    for (size_t i = 0; i < m->n; i++) largest = fmaxf(largest, luminance_of(m, values, i));
    for (size_t i = 0; i < m->n; i++) lit[i] = luminance_of(m, values, i) > 1e-6f * largest;
}

void render_mark_glowing(const mesh *m, const float *values, const float *E, bool *glows) {
    for (size_t i = 0; i < m->n; i++)
        glows[i] = E != NULL && luminance_of(m, E, i) > .5f * luminance_of(m, values, i);
}

double render_round_up(double x) {
    static const double steps[] = {1, 1.2, 1.6, 2, 2.4, 2.8, 3.2, 4, 4.8, 6, 8, 10};
    if (!(x > 0)) return 1;
    const double unit = pow(10, floor(log10(x)));
    size_t i = 0;
    while (i + 1 < sizeof steps / sizeof steps[0] && steps[i] * unit < x) i++;
    return steps[i] * unit;
}

/* The columns of the picture that show the scene. */
static size_t view_width(const render_options *f) {
    return f->size.width - (f->false_color ? picture_legend_width(f->size.width, f->size.height) : 0);
}

void render_view_close(render_view *v) {
    smooth_nodes_free(&v->nodes);
    visibility_destroy(v->seen);
    mesh_free(&v->m);
    store_close(v->s);
}

lam_status render_view_open(const char *path, const render_options *f, render_view *v, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(atomic_file_check(f->output, error));
    TRY(store_open(path, &v->s, error));
    TRY(mesh_load(v->s, &v->m, NULL, error));
done:
    return status;
}

lam_status render_view_aim(const render_options *f, bool smooth, const bool *lit, render_view *v,
                           lam_error *error) {
    lam_status status = LAM_OK;
    const double aspect = (double)view_width(f) / (double)f->size.height;
    const render_camera *given = &f->camera;
    TRY(visibility_create(&v->m, &v->seen, error));
    if (smooth) TRY(smooth_nodes_create(&v->m, &v->nodes, error));
    if (given->given)
        TRY(camera_look(given->eye, given->target, given->fov, aspect, v->m.up, &v->camera, error));
    else
        TRY(camera_choose(&v->m, v->seen, lit, aspect, &v->camera, error));
    v->pixels = (raster_view){.mesh = &v->m,
                              .visibility = v->seen,
                              .camera = &v->camera,
                              .width = view_width(f),
                              .height = f->size.height,
                              .samples = RASTER_SAMPLES,
                              .smooth = smooth};
done:
    return status;
}

lam_status render_view_shade(const render_view *v, size_t n_channels, const float *values, const float *E,
                             shade **out, lam_error *error) {
    return shade_create(&v->m, n_channels, values, E, v->pixels.smooth ? &v->nodes : NULL, out, error);
}

picture_options render_style(const render_options *f, const picture_light *light) {
    const tone_histogram *shown = picture_light_shown(light);
    picture_options style = {0};
    if (f->false_color)
        style.range = render_round_up(tone_histogram_quantile(shown, .99) / exp2(f->exposure));
    else
        style.exposure = tone_exposure(shown) * exp2(f->exposure);
    return style;
}

lam_status render_image(const render_options *f, const picture_options *style, size_t n_channels, image *out,
                        lam_error *error) {
    const size_t channels = style->range > 0 || n_channels >= SHADE_MAX_CHANNELS ? 3 : 1;
    return image_create(f->size.width, f->size.height, channels, out, error);
}

void render_log_camera(const camera *c, terminal *t) {
    terminal_log(t, "camera %.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.4g", c->eye[0], c->eye[1], c->eye[2],
                 c->eye[0] + c->forward[0], c->eye[1] + c->forward[1], c->eye[2] + c->forward[2],
                 2 * atan(c->tan_y) * 180 / M_PI);
}

void render_log_style(const picture_options *style, terminal *t) {
    if (style->range > 0)
        terminal_log(t, "colours from 0 to %g W/m2", style->range);
    else
        terminal_log(t, "white is about %.3g W/m2", 1 / style->exposure);
}
