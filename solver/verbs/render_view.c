#include "solver/verbs/render_view.h"

#include "solver/base/atomic_file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static float element_luminance(const mesh *m, const float *values, size_t i) {
    float channels[3] = {0, 0, 0};
    for (size_t c = 0; c < m->n_channels && c < 3; c++) channels[c] = values[c * m->n + i];
    return tone_luminance(channels, m->n_channels);
}

void render_mark_lit(const mesh *m, const float *values, bool *lit) {
    float largest = 0;
    for (size_t i = 0; i < m->n; i++) largest = fmaxf(largest, element_luminance(m, values, i));
    for (size_t i = 0; i < m->n; i++) lit[i] = element_luminance(m, values, i) > 1e-6f * largest;
}

void render_mark_glowing(const mesh *m, const float *values, const float *E, bool *glows) {
    for (size_t i = 0; i < m->n; i++)
        glows[i] = E != NULL && element_luminance(m, E, i) > .5f * element_luminance(m, values, i);
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
    v->exr = render_is_exr(f);
    if (v->exr && v->m.n_channels > SHADE_MAX_CHANNELS)
        FAIL(error, LAM_ERR_UNSUPPORTED, "%s: has %zu channels, an EXR at most %d; draw a .png", path,
             v->m.n_channels, SHADE_MAX_CHANNELS);
done:
    return status;
}

/* Places the camera of the scene that has this name. */
static lam_status place_named(render_view *v, const char *name, double aspect, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = &v->m;
    const scene_camera *found = scene_camera_find(m->n_cameras, m->cameras, name);
    enum { TOLD = 6 };
    char names[TOLD * 42 + 1] = "";
    size_t length = 0, told = 0;
    if (found != NULL)
        return camera_place(found->eye, found->direction, found->up, found->fov, aspect, &v->camera, error);
    if (m->n_cameras == 0)
        FAIL(error, LAM_ERR_ARGUMENT,
             "--camera %s: the scene came without cameras; give EYE,TARGET,FOV as x,y,z,x,y,z,degrees", name);
    for (; told < m->n_cameras && told < TOLD; told++)
        length += (size_t)snprintf(names + length, sizeof names - length, "%s%.40s", told > 0 ? ", " : "",
                                   m->cameras[told].name);
    FAIL(error, LAM_ERR_ARGUMENT, "--camera %s: no camera of this name; there %s %s%s", name,
         m->n_cameras == 1 ? "is" : "are", names, told < m->n_cameras ? " and others" : "");
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
    if (given->name != NULL)
        TRY(place_named(v, given->name, aspect, error));
    else if (given->given)
        TRY(camera_look(given->eye, given->target, given->fov, aspect, v->m.up, &v->camera, error));
    else
        TRY(camera_choose(&v->m, v->seen, lit, aspect, &v->camera, error));
    v->pixels = (raster_view){.mesh = &v->m,
                              .visibility = v->seen,
                              .camera = &v->camera,
                              .width = view_width(f),
                              .height = f->size.height,
                              .samples = (size_t)strtoul(f->samples, NULL, 10),
                              .smooth = smooth};
done:
    return status;
}

lam_status render_view_shade(const render_view *v, size_t n_channels, const float *values, const float *E,
                             shade **out, lam_error *error) {
    const size_t drawn = v->exr || n_channels < TONE_CHANNELS ? n_channels : TONE_CHANNELS;
    return shade_create(&v->m, drawn, values, E, v->pixels.smooth ? &v->nodes : NULL, out, error);
}

/* The ends of a scale for values from low, an estimate that may be 0, to high. */
static color_scale scale_between(const render_options *f, double low, double high) {
    color_scale scale = {.palette = palette_find(f->palette), .logarithmic = f->logarithmic};
    if (f->range.high > 0) {
        scale.low = f->range.low;
        scale.high = f->range.high;
        return scale;
    }
    scale.high = render_round_up(high);
    if (f->logarithmic) scale.low = pow(10, floor(log10(fmax(low, scale.high * 1e-3)) + 1e-9));
    if (f->logarithmic && !(scale.low < .5 * scale.high)) scale.low = .1 * scale.high;
    return scale;
}

color_scale render_scale(const render_options *f, double high) {
    return scale_between(f, 0, high);
}

picture_options render_style(const render_options *f, const picture_light *light, const smooth_nodes *nodes) {
    const tone_histogram *shown = picture_light_shown(light);
    const double factor = exp2(f->exposure);
    picture_options style = {0};
    if (f->false_color) {
        style.scale = scale_between(f, tone_histogram_quantile(shown, .01) / factor,
                                    tone_histogram_quantile(shown, .99) / factor);
        style.iso_lines = f->iso_lines;
        style.nodes = nodes;
    } else {
        style.exposure = tone_exposure(shown) * factor;
    }
    return style;
}

lam_status render_sheet_create(const render_options *f, const picture_options *style, size_t n_channels,
                               render_sheet *out, lam_error *error) {
    const size_t colors = style->scale.palette != NULL || n_channels >= TONE_CHANNELS ? 3 : 1;
    if (render_is_exr(f))
        return picture_values_create(f->size.width, f->size.height, n_channels, &out->values, error);
    return image_create(f->size.width, f->size.height, colors, &out->picture, error);
}

void render_sheet_free(render_sheet *sheet) {
    image_free(&sheet->picture);
    picture_values_free(&sheet->values);
}

const char *render_unit(const render_options *f, const lit_store *lit) {
    return light_conversion_unit(&lit->told, (lam_quantity)f->quantity != LAM_IRRADIANCE);
}

lam_status render_sheet_write(const render_options *f, const picture_options *style, const char *unit,
                              render_sheet *sheet, const char *path, size_t *clamped, lam_error *error) {
    char name[OPTION_WORD_BYTES];
    const exr_notes notes = {.quantity = render_quantity_name(f, name), .unit = unit};
    *clamped = 0;
    if (render_is_exr(f)) return exr_write(&sheet->values, f->single, &notes, path, clamped, error);
    if (style->scale.palette != NULL) picture_legend(&style->scale, unit, &sheet->picture);
    return image_write_png(&sheet->picture, path, error);
}

void render_log_clamped(size_t clamped, terminal *t) {
    if (clamped > 0)
        terminal_warn(t, "%zu values above 65504 were written as that; --float holds them", clamped);
}

void render_log_camera(const camera *c, terminal *t) {
    terminal_log(t, "camera %.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.4g", c->eye[0], c->eye[1], c->eye[2],
                 c->eye[0] + c->forward[0], c->eye[1] + c->forward[1], c->eye[2] + c->forward[2],
                 2 * atan(c->tan_y) * 180 / M_PI);
}

void render_log_style(const render_options *f, const picture_options *style, const char *unit, terminal *t) {
    if (render_is_exr(f)) return;
    if (style->scale.palette != NULL)
        terminal_log(t, "colours from %g to %g %s", style->scale.low, style->scale.high, unit);
    else
        terminal_log(t, "white is about %.3g %s", 1 / style->exposure, unit);
}
