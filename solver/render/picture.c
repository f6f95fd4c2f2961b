#include "solver/render/picture.h"

#include "solver/render/iso_lines.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Display-linear grey behind everything (sRGB 38 of 255). */
#define BACKGROUND 0.0194f

/* The longer side of the coarse picture that exposure is measured on. */
#define MEASURE_SIDE 192

raster_view picture_coarse(const raster_view *view) {
    const camera *c = view->camera;
    const bool wide = c->tan_x >= c->tan_y;
    raster_view coarse = *view;
    coarse.width = wide ? MEASURE_SIDE : (size_t)ceil(MEASURE_SIDE * c->tan_x / c->tan_y);
    coarse.height = wide ? (size_t)ceil(MEASURE_SIDE * c->tan_y / c->tan_x) : MEASURE_SIDE;
    coarse.samples = 1;
    return coarse;
}

void picture_measure(const raster *coarse, const shade *light, const bool *glows, picture_light *sum) {
    const size_t channels = shade_channels(light);
    for (size_t t = 0; t < coarse->n_tiles; t++) {
        const raster_tile *tile = &coarse->tiles[t];
        const size_t n_parts = tile->from[(tile->right - tile->left) * (tile->bottom - tile->top)];
        for (size_t p = 0; p < n_parts; p++) {
            const uint32_t element = tile->parts[p].element;
            float values[SHADE_MAX_CHANNELS];
            if (element == VISIBILITY_NOTHING) continue;
            shade_mix(light, element, tile->weights != NULL ? tile->weights[p] : NULL, values);
            const float luminance = tone_luminance(values, channels);
            tone_histogram_add(&sum->all, luminance);
            if (!glows[element]) tone_histogram_add(&sum->reflected, luminance);
        }
    }
}

static void histogram_join(tone_histogram *sum, const tone_histogram *other) {
    for (size_t bin = 0; bin < TONE_BINS; bin++) sum->counts[bin] += other->counts[bin];
    sum->total += other->total;
}

void picture_light_add(picture_light *sum, const picture_light *other) {
    histogram_join(&sum->reflected, &other->reflected);
    histogram_join(&sum->all, &other->all);
}

const tone_histogram *picture_light_shown(const picture_light *sum) {
    const tone_histogram *reflected = &sum->reflected;
    const bool enough = reflected->total * 100 >= sum->all.total;
    return enough && tone_histogram_quantile(reflected, 1) > 0 ? reflected : &sum->all;
}

/* Adds the display-linear colour of a part, weighted by its rays, to a pixel's sum. Parts are toned before
 * they are averaged: a lamp a thousand times as bright as white would make each pixel that it touches white,
 * and its edge aliased. */
static void add_part(const shade *light, const picture_options *how, const raster_part *part,
                     const float *weights, size_t channels_out, float *sum) {
    const size_t channels = shade_channels(light);
    const float rays = (float)part->rays;
    float values[SHADE_MAX_CHANNELS], rgb[3];
    if (part->element == VISIBILITY_NOTHING) {
        for (size_t k = 0; k < channels_out; k++) sum[k] += rays * BACKGROUND;
        return;
    }
    shade_mix(light, part->element, weights, values);
    if (how->scale.palette != NULL) {
        const double value = (double)tone_luminance(values, channels);
        palette_color(how->scale.palette, (float)color_scale_place(&how->scale, value), rgb);
        for (size_t k = 0; k < channels_out; k++) sum[k] += rays * tone_decode(rgb[k]);
        return;
    }
    if (!how->plain) {
        for (size_t k = 0; k < channels; k++) values[k] *= (float)how->exposure;
        if (channels == 3)
            tone_color(values);
        else
            values[0] = tone_curve(tone_luminance(values, channels));
    }
    for (size_t k = 0; k < channels_out; k++) sum[k] += rays * values[channels == 3 ? k : 0];
}

/* True where two pixels side by side show nothing but one element, on which light is constant. */
static bool is_repeated(const raster_tile *tile, const uint32_t *from) {
    return tile->weights == NULL && from[1] - from[0] == 1 && from[2] - from[1] == 1 &&
           tile->parts[from[0]].element == tile->parts[from[1]].element;
}

static void fill_tile(const raster_tile *tile, const shade *light, const picture_options *how, float samples,
                      image *picture) {
    const uint32_t *from = tile->from;
    const size_t channels = picture->channels;
    for (size_t y = tile->top; y < tile->bottom; y++)
        for (size_t x = tile->left; x < tile->right; x++, from++) {
            float sum[3] = {0, 0, 0};
            uint8_t *pixel = picture->pixels + (y * picture->width + x) * channels;
            if (x > tile->left && is_repeated(tile, from - 1)) {
                memcpy(pixel, pixel - channels, channels);
                continue;
            }
            for (uint32_t p = from[0]; p < from[1]; p++)
                add_part(light, how, &tile->parts[p], tile->weights != NULL ? tile->weights[p] : NULL,
                         channels, sum);
            for (size_t k = 0; k < channels; k++) pixel[k] = tone_encode(sum[k] / samples);
        }
}

/* The means over the rays of each pixel. */
static void fill_values(const raster_tile *tile, const shade *light, float samples, picture_values *out) {
    const uint32_t *from = tile->from;
    const size_t channels = out->channels;
    for (size_t y = tile->top; y < tile->bottom; y++)
        for (size_t x = tile->left; x < tile->right; x++, from++) {
            float *sum = out->values + (y * out->width + x) * channels;
            memset(sum, 0, channels * sizeof *sum);
            for (uint32_t p = from[0]; p < from[1]; p++) {
                float values[SHADE_MAX_CHANNELS];
                const float share = (float)tile->parts[p].rays / samples;
                if (tile->parts[p].element == VISIBILITY_NOTHING) continue;
                shade_mix(light, tile->parts[p].element, tile->weights != NULL ? tile->weights[p] : NULL,
                          values);
                for (size_t c = 0; c < channels; c++) sum[c] += share * values[c];
            }
        }
}

/* The light of a view and what its tiles are drawn into, of which each may be NULL. */
typedef struct canvas {
    const shade *light;
    const picture_options *how;
    image *picture;
    picture_values *values;
    iso_field *field;
} canvas;

static void paint_tile(const canvas *to, const raster_tile *tile, size_t samples) {
    if (to->picture != NULL) fill_tile(tile, to->light, to->how, (float)samples, to->picture);
    if (to->values != NULL) fill_values(tile, to->light, (float)samples, to->values);
    if (to->field != NULL) iso_field_tile(tile, to->light, &to->how->scale, to->field);
}

static void paint(const canvas *to, const raster *r) {
    for (size_t t = 0; t < r->n_tiles; t++) paint_tile(to, &r->tiles[t], r->samples);
}

static lam_status paint_view(const canvas *to, const raster_view *view, const progress *waiting,
                             lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n_tiles = raster_tiles(view);
    size_t drawn = 0;
#pragma omp parallel for schedule(dynamic)
    for (size_t t = 0; t < n_tiles; t++) {
        raster_tile tile = raster_tile_at(view, t);
        lam_error own = {0};
        if (progress_cancelled(waiting)) continue;
        const lam_status made = raster_tile_create(view, &tile, &own);
        if (made == LAM_OK) paint_tile(to, &tile, view->samples);
        raster_tile_free(&tile);
#pragma omp critical(picture_progress)
        {
            if (made != LAM_OK) {
                status = made;
                if (error != NULL) *error = own;
            }
            progress_report(waiting, "drawing", (double)++drawn / (double)n_tiles);
        }
    }
    if (status == LAM_OK && drawn < n_tiles) status = status_fail(error, LAM_ERR_CANCELLED, "cancelled");
    return status;
}

lam_status picture_fill(const raster *r, const shade *light, const picture_options *how, image *picture,
                        lam_error *error) {
    lam_status status = LAM_OK;
    iso_field field = {.place = NULL};
    canvas to = {.light = light, .how = how, .picture = picture};
    if (how->iso_lines > 0) {
        TRY(iso_field_create(r->width, r->height, &field, error));
        to.field = &field;
    }
    paint(&to, r);
    if (how->iso_lines > 0) iso_lines_draw(&field, how->nodes, how->iso_lines, picture);
done:
    iso_field_free(&field);
    return status;
}

lam_status picture_draw(const raster_view *view, const shade *light, const picture_options *how,
                        const progress *waiting, image *picture, lam_error *error) {
    lam_status status = LAM_OK;
    iso_field field = {.place = NULL};
    canvas to = {.light = light, .how = how, .picture = picture};
    if (how->iso_lines > 0) {
        TRY(iso_field_create(view->width, view->height, &field, error));
        to.field = &field;
    }
    TRY(paint_view(&to, view, waiting, error));
    if (how->iso_lines > 0) iso_lines_draw(&field, how->nodes, how->iso_lines, picture);
done:
    iso_field_free(&field);
    return status;
}

lam_status picture_values_create(size_t width, size_t height, size_t channels, picture_values *out,
                                 lam_error *error) {
    lam_status status = LAM_OK;
    size_t row;
    TRY(image_check_size(width, height, error));
    if (!size_multiply(width * sizeof(float), channels, &row))
        FAIL(error, LAM_ERR_MEMORY, "picture of %zux%zu pixels: too large", width, height);
    float *values = memory_allocate(height, row, "picture", error);
    if (values == NULL) return LAM_ERR_MEMORY;
    *out = (picture_values){.width = width, .height = height, .channels = channels, .values = values};
done:
    return status;
}

void picture_values_free(picture_values *v) {
    free(v->values);
    *v = (picture_values){0};
}

void picture_values_fill(const raster *r, const shade *light, picture_values *out) {
    const canvas to = {.light = light, .values = out};
    paint(&to, r);
}

lam_status picture_values_draw(const raster_view *view, const shade *light, const progress *waiting,
                               picture_values *out, lam_error *error) {
    const canvas to = {.light = light, .values = out};
    return paint_view(&to, view, waiting, error);
}
