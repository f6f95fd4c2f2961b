#include "solver/render/picture.h"

#include <math.h>
#include <string.h>

/* The side, in pixels, of the square that one thread draws at a time. */
#define TILE 32

/* Rays of a pixel: two packets, placed as a (0, 4, 2)-net in base 2, with one point in each elementary cell.
 */
#define SAMPLES 16
#define PACKETS (SAMPLES / VISIBILITY_PACKET)

/* Display-linear grey behind everything (sRGB 38 of 255). */
#define BACKGROUND 0.0194f

/* A ray that slips between two elements is cast again this far away, in pixels. */
#define SIDESTEP 0.02

/* The longer side of the coarse picture that exposure is measured on. */
#define MEASURE_SIDE 192

static double sample_x(size_t i) {
    return ((double)i + .5) / SAMPLES;
}

static double sample_y(size_t i) {
    size_t reversed = 0;
    for (size_t bit = 1; bit < SAMPLES; bit <<= 1) reversed = reversed << 1 | (i & bit ? 1u : 0u);
    return ((double)reversed + .5) / SAMPLES;
}

static void aim(const picture_scene *scene, const camera *c, double x, double y, ray_packet *rays, size_t i) {
    float eye[3];
    double direction[3];
    visibility_recentre(scene->visibility, c->eye, eye);
    camera_direction(c, x, y, direction);
    for (int d = 0; d < 3; d++) {
        rays->origin[d][i] = eye[d];
        rays->direction[d][i] = (float)direction[d];
    }
}

/* The values at the point where the ray through (x, y) meets the plane of an element, in double. */
static void values_at(const picture_scene *scene, const camera *c, double x, double y, uint32_t element,
                      float *values) {
    const mesh *m = scene->mesh;
    const double *corner = m->vertices[m->elements[element][0]];
    double direction[3], point[3], along = 0, away = 0;
    camera_direction(c, x, y, direction);
    for (int d = 0; d < 3; d++) {
        away += (double)m->normal[element][d] * (corner[d] - c->eye[d]);
        along += (double)m->normal[element][d] * direction[d];
    }
    for (int d = 0; d < 3; d++) point[d] = c->eye[d] + (along != 0 ? away / along : 0) * direction[d];
    shade_at(scene->shade, element, point, values);
}

void picture_measure(const picture_scene *scene, const camera *c, tone_histogram *h) {
    const size_t channels = shade_channels(scene->shade);
    const size_t width =
        c->tan_x >= c->tan_y ? MEASURE_SIDE : (size_t)ceil(MEASURE_SIDE * c->tan_x / c->tan_y);
    const size_t height =
        c->tan_x >= c->tan_y ? (size_t)ceil(MEASURE_SIDE * c->tan_y / c->tan_x) : MEASURE_SIDE;
    size_t shown = 0;
    tone_histogram all = {0};
    for (size_t y = 0; y < height; y++)
        for (size_t first = 0; first < width; first += VISIBILITY_PACKET) {
            const size_t count = width - first < VISIBILITY_PACKET ? width - first : VISIBILITY_PACKET;
            const double v = ((double)y + .5) / (double)height;
            ray_packet rays;
            hit_packet hits;
            memset(&rays, 0, sizeof rays);
            for (size_t i = 0; i < count; i++)
                aim(scene, c, ((double)(first + i) + .5) / (double)width, v, &rays, i);
            visibility_cast(scene->visibility, &rays, count, NULL, VISIBILITY_CULL_BACK | VISIBILITY_TOGETHER,
                            &hits);
            for (size_t i = 0; i < count; i++) {
                float values[SHADE_MAX_CHANNELS];
                if (hits.element[i] == VISIBILITY_NOTHING) continue;
                values_at(scene, c, ((double)(first + i) + .5) / (double)width, v, hits.element[i], values);
                shown++;
                tone_histogram_add(&all, tone_luminance(values, channels));
                if (!scene->glows[hits.element[i]]) tone_histogram_add(h, tone_luminance(values, channels));
            }
        }
    if (h->total * 100 < shown || !(tone_histogram_quantile(h, 1) > 0)) *h = all;
}

/* Adds the display-linear colour of one ray to a pixel's sum. */
static void add_sample(const picture_scene *scene, const camera *c, const picture_options *how, double x,
                       double y, uint32_t element, size_t channels_out, float *sum) {
    float values[SHADE_MAX_CHANNELS], rgb[3];
    if (element == VISIBILITY_NOTHING) {
        for (size_t k = 0; k < channels_out; k++) sum[k] += BACKGROUND;
        return;
    }
    const size_t channels = shade_channels(scene->shade);
    values_at(scene, c, x, y, element, values);
    if (how->range > 0) {
        tone_false_color((float)(tone_luminance(values, channels) / how->range), rgb);
        for (size_t k = 0; k < channels_out; k++) sum[k] += tone_decode(rgb[k]);
        return;
    }
    if (how->plain) {
        for (size_t k = 0; k < channels_out; k++) sum[k] += values[channels == 3 ? k : 0];
        return;
    }
    /* Samples are toned before they are averaged, or the edge of a lamp would be as white as the lamp and
     * aliased. */
    for (size_t k = 0; k < channels; k++) values[k] *= (float)how->exposure;
    if (channels == 3)
        tone_color(values);
    else
        values[0] = tone_curve(tone_luminance(values, channels));
    for (size_t k = 0; k < channels_out; k++) sum[k] += values[channels == 3 ? k : 0];
}

static void draw_pixel(const picture_scene *scene, const camera *c, const picture_options *how, size_t px,
                       size_t py, image *picture) {
    double x[SAMPLES], y[SAMPLES];
    uint32_t element[SAMPLES];
    size_t missed = 0;
    float sum[3] = {0, 0, 0};
    for (size_t p = 0; p < PACKETS; p++) {
        ray_packet rays;
        hit_packet hits;
        for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
            const size_t s = p * VISIBILITY_PACKET + i;
            x[s] = ((double)px + sample_x(s)) / (double)how->width;
            y[s] = ((double)py + sample_y(s)) / (double)picture->height;
            aim(scene, c, x[s], y[s], &rays, i);
        }
        visibility_cast(scene->visibility, &rays, VISIBILITY_PACKET, NULL,
                        VISIBILITY_CULL_BACK | VISIBILITY_TOGETHER, &hits);
        memcpy(element + p * VISIBILITY_PACKET, hits.element, sizeof hits.element);
    }
    for (size_t s = 0; s < SAMPLES; s++) missed += element[s] == VISIBILITY_NOTHING;
    /* Elements that only touch leave gaps of rounding. In a pixel with hits, a miss is cast again a little
     * aside. */
    for (size_t s = 0; s < SAMPLES && missed > 0 && missed < SAMPLES; s++) {
        ray_packet rays;
        hit_packet hits;
        if (element[s] != VISIBILITY_NOTHING) continue;
        const double x2 = x[s] + SIDESTEP / (double)how->width,
                     y2 = y[s] + SIDESTEP / (double)picture->height;
        memset(&rays, 0, sizeof rays);
        aim(scene, c, x2, y2, &rays, 0);
        visibility_cast(scene->visibility, &rays, 1, NULL, VISIBILITY_CULL_BACK, &hits);
        element[s] = hits.element[0];
        if (element[s] == VISIBILITY_NOTHING) continue;
        x[s] = x2;
        y[s] = y2;
    }
    for (size_t s = 0; s < SAMPLES; s++)
        add_sample(scene, c, how, x[s], y[s], element[s], picture->channels, sum);
    uint8_t *pixel = picture->pixels + (py * picture->width + px) * picture->channels;
    for (size_t k = 0; k < picture->channels; k++) pixel[k] = tone_encode(sum[k] / SAMPLES);
}

lam_status picture_draw(const picture_scene *scene, const camera *c, const picture_options *how,
                        const progress *waiting, image *picture, lam_error *error) {
    const size_t across = (how->width + TILE - 1) / TILE, down = (picture->height + TILE - 1) / TILE;
    size_t drawn = 0;
#pragma omp parallel for schedule(dynamic)
    for (size_t tile = 0; tile < across * down; tile++) {
        const size_t left = tile % across * TILE, top = tile / across * TILE;
        const size_t right = left + TILE < how->width ? left + TILE : how->width;
        const size_t bottom = top + TILE < picture->height ? top + TILE : picture->height;
        if (progress_cancelled(waiting)) continue;
        for (size_t y = top; y < bottom; y++)
            for (size_t x = left; x < right; x++) draw_pixel(scene, c, how, x, y, picture);
#pragma omp critical(picture_progress)
        progress_report(waiting, "drawing", (double)++drawn / (double)(across * down));
    }
    if (drawn < across * down) return status_fail(error, LAM_ERR_CANCELLED, "cancelled");
    return LAM_OK;
}
