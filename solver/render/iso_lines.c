#include "solver/render/iso_lines.h"

#include "solver/render/tone.h"

#include <math.h>
#include <stdlib.h>

/* Half the width of a line, and the pixel within which it fades at each side. */
static const float half_width = .6f, fade = 1;

lam_status iso_field_create(size_t width, size_t height, iso_field *out, lam_error *error) {
    lam_status status = LAM_OK;
    iso_field f = {.width = width, .height = height};
    f.place = memory_allocate(height, width * sizeof *f.place, "iso-lines", error);
    f.element = memory_allocate(height, width * sizeof *f.element, "iso-lines", error);
    if (f.place == NULL || f.element == NULL) TRY(LAM_ERR_MEMORY);
    *out = f;
    f = (iso_field){.place = NULL};
done:
    iso_field_free(&f);
    return status;
}

void iso_field_free(iso_field *f) {
    free(f->place);
    free(f->element);
    *f = (iso_field){.place = NULL};
}

void iso_field_tile(const raster_tile *tile, const shade *light, const color_scale *scale, iso_field *f) {
    const uint32_t *from = tile->from;
    for (size_t y = tile->top; y < tile->bottom; y++)
        for (size_t x = tile->left; x < tile->right; x++, from++) {
            const size_t at = y * f->width + x;
            float values[SHADE_MAX_CHANNELS];
            uint32_t most = from[0];
            for (uint32_t p = from[0]; p < from[1]; p++)
                if (tile->parts[p].rays > tile->parts[most].rays) most = p;
            f->element[at] = tile->parts[most].element;
            if (f->element[at] == VISIBILITY_NOTHING) continue;
            shade_mix(light, f->element[at], tile->weights != NULL ? tile->weights[most] : NULL, values);
            const float luminance = tone_luminance(values, shade_channels(light));
            f->place[at] = (float)color_scale_place(scale, (double)luminance);
        }
}

static bool is_joined(const smooth_nodes *nodes, uint32_t a, uint32_t b) {
    if (a == b) return true;
    if (a == VISIBILITY_NOTHING || b == VISIBILITY_NOTHING) return false;
    for (size_t i = 0; i < 4; i++)
        for (size_t j = 0; j < 4; j++)
            if (nodes->corner[a][i] != CORNER_NONE && nodes->corner[a][i] == nodes->corner[b][j]) return true;
    return false;
}

/* The larger of the differences to the pixels before and after along one axis, 0 where neither is joined. */
static float slope_along(const iso_field *f, const smooth_nodes *nodes, size_t at, size_t i, size_t count,
                         size_t stride) {
    float slope = 0;
    if (i > 0 && is_joined(nodes, f->element[at], f->element[at - stride]))
        slope = fabsf(f->place[at] - f->place[at - stride]);
    if (i + 1 < count && is_joined(nodes, f->element[at], f->element[at + stride]))
        slope = fmaxf(slope, fabsf(f->place[at + stride] - f->place[at]));
    return isfinite(slope) ? slope : 0;
}

/* The share of a pixel that the nearest line covers. */
static float cover(const iso_field *f, const smooth_nodes *nodes, size_t n, size_t x, size_t y) {
    const size_t at = y * f->width + x;
    const float steps = (float)n, place = f->place[at];
    const float nearest = fminf(fmaxf(rintf(place * steps), 1), steps) / steps;
    const float across = slope_along(f, nodes, at, x, f->width, 1);
    const float down = slope_along(f, nodes, at, y, f->height, f->width);
    const float gradient = hypotf(across, down);
    if (!(gradient > 0) || !isfinite(place)) return 0;
    const float away = fabsf(place - nearest) / gradient;
    return fminf(fmaxf((half_width - away) / fade + .5f, 0), 1);
}

/* Ink is black on bright colours and white on dark ones. */
static void ink(uint8_t *pixel, float share) {
    float rgb[3];
    for (int c = 0; c < 3; c++) rgb[c] = tone_decode((float)pixel[c] / 255);
    const float paint = tone_luminance(rgb, 3) > .1f ? 0 : 1;
    for (int c = 0; c < 3; c++) pixel[c] = tone_encode((1 - share) * rgb[c] + share * paint);
}

void iso_lines_draw(const iso_field *f, const smooth_nodes *nodes, size_t n, image *picture) {
#pragma omp parallel for schedule(static)
    for (size_t y = 0; y < f->height; y++)
        for (size_t x = 0; x < f->width; x++) {
            if (f->element[y * f->width + x] == VISIBILITY_NOTHING) continue;
            const float share = cover(f, nodes, n, x, y);
            if (share > 0) ink(picture->pixels + (y * picture->width + x) * 3, .8f * share);
        }
}
