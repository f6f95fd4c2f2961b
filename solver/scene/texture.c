/* Means of images over polygons. With P(x, y) the integral of the image along its row from 0 to x, the
 * integral over a polygon is that of P dy along its border (Green); P is linear within a pixel. */
#include "solver/scene/texture.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct texture_table {
    size_t width, height;
    double unit;         /* of a sum: linear light of one pixel */
    uint32_t (*sums)[3]; /* [height][width + 1]: sums over the pixels of a row that come before */
};

void texture_linear_levels(double linear[256]) {
    for (int k = 0; k < 256; k++) {
        const double x = k / 255.;
        linear[k] = x <= .04045 ? x / 12.92 : pow((x + .055) / 1.055, 2.4);
    }
}

lam_status texture_table_create(const texture_image *image, texture_table **out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t width = image->width, height = image->height;
    const double scale = floor(UINT32_MAX / (double)width); /* a whole white row fits in 32 bits */
    double linear[256];
    uint32_t level[256];
    texture_table *t = memory_allocate(1, sizeof *t, "texture", error);
    if (t == NULL) return LAM_ERR_MEMORY;
    *t = (texture_table){.width = width, .height = height, .unit = 1 / scale};
    t->sums = memory_allocate(height, (width + 1) * sizeof *t->sums, "texture", error);
    if (t->sums == NULL) TRY(LAM_ERR_MEMORY);
    texture_linear_levels(linear);
    for (int k = 0; k < 256; k++) level[k] = (uint32_t)(scale * linear[k]);
    for (size_t y = 0; y < height; y++) {
        uint32_t(*sum)[3] = t->sums + y * (width + 1);
        const uint8_t(*pixel)[3] = (const uint8_t(*)[3])image->pixels + y * width;
        memset(sum, 0, sizeof *sum);
        for (size_t x = 0; x < width; x++)
            for (int c = 0; c < 3; c++) sum[x + 1][c] = sum[x][c] + level[pixel[x][c]];
    }
    *out = t;
    t = NULL;
done:
    texture_table_free(t);
    return status;
}

void texture_table_free(texture_table *t) {
    if (t == NULL) return;
    free(t->sums);
    free(t);
}

/* The row or column 0 ... size-1 at a whole number. */
static size_t wrapped(double at, size_t size, texture_wrap wrap) {
    const double n = (double)size;
    if (wrap == TEXTURE_CLAMP) return at < 0 ? 0 : at >= n ? size - 1 : (size_t)at;
    const double period = wrap == TEXTURE_MIRROR ? 2 * n : n;
    double within = at - period * floor(at / period);
    if (within >= period) within = 0; /* by rounding */
    return within < n ? (size_t)within : 2 * size - 1 - (size_t)within;
}

/* P within the image, 0 <= x <= width. */
static void sum_within(const texture_table *t, const uint32_t (*row)[3], double x, double out[3]) {
    const size_t i = x >= (double)t->width ? t->width - 1 : (size_t)x;
    for (int c = 0; c < 3; c++) out[c] = row[i][c] + (x - (double)i) * (row[i + 1][c] - row[i][c]);
}

static void sum_to(const texture_table *t, texture_wrap wrap, const uint32_t (*row)[3], double x,
                   double out[3]) {
    const double n = (double)t->width;
    const uint32_t *whole = row[t->width];
    if (wrap == TEXTURE_CLAMP) {
        const double within = fmin(fmax(x, 0), n), beyond = x - within;
        const uint32_t *side = beyond < 0 ? row[1] : whole, *before = beyond < 0 ? row[0] : row[t->width - 1];
        sum_within(t, row, within, out);
        for (int c = 0; c < 3; c++) out[c] += beyond * (side[c] - before[c]);
        return;
    }
    const double period = wrap == TEXTURE_MIRROR ? 2 * n : n, k = floor(x / period);
    const double within = fmin(fmax(x - k * period, 0), period);
    const bool back = within > n;
    sum_within(t, row, back ? period - within : within, out);
    for (int c = 0; c < 3; c++)
        out[c] = (back ? 2. * whole[c] - out[c] : out[c]) + k * (period / n) * whole[c];
}

/* The whole numbers that a coordinate passes on the way from a to a + d. */
typedef struct crossings {
    double at, step, last; /* the next one, and the last that matters */
} crossings;

static crossings crossings_of(double a, double d, size_t size, texture_wrap wrap) {
    crossings c = {.step = d < 0 ? -1 : 1, .last = a + d};
    c.at = d < 0 ? ceil(a) - 1 : floor(a) + 1;
    if (wrap == TEXTURE_CLAMP) { /* nothing changes outside the image */
        const double n = (double)size;
        c.at = d < 0 ? fmin(c.at, n) : fmax(c.at, 0);
        c.last = d < 0 ? fmax(c.last, 0) : fmin(c.last, n);
    }
    return c;
}

static double crossing_next(const crossings *c, double a, double d) {
    const bool over = c->step < 0 ? c->at < c->last : c->at > c->last;
    return d == 0 || over ? HUGE_VAL : (c->at - a) / d;
}

static double crossing_count(const crossings *c) {
    return fmax((c->last - c->at) * c->step + 1, 0);
}

/* More pixels than these along an edge are sampled. */
enum { CROSSINGS_MOST = 32768 };

/* Adds the integral of P dy from a to b, in pixels. */
static void add_edge(const texture_table *t, const texture_wrap wrap[2], const double a[2], const double b[2],
                     double sum[3]) {
    const double d[2] = {b[0] - a[0], b[1] - a[1]};
    crossings x = crossings_of(a[0], d[0], t->width, wrap[0]);
    crossings y = crossings_of(a[1], d[1], t->height, wrap[1]);
    const bool sampled = crossing_count(&x) + crossing_count(&y) > CROSSINGS_MOST;
    if (d[1] == 0) return;
    for (double from = 0; from < 1;) {
        double to = from + 1. / CROSSINGS_MOST;
        if (!sampled) {
            const double at_x = crossing_next(&x, a[0], d[0]), at_y = crossing_next(&y, a[1], d[1]);
            to = fmin(at_x, at_y);
            if (at_x <= to) x.at += x.step;
            if (at_y <= to) y.at += y.step;
        }
        to = fmin(to, 1);
        const double middle = (from + to) / 2, share = (to - from) * d[1];
        double value[3];
        const size_t row = wrapped(floor(a[1] + middle * d[1]), t->height, wrap[1]);
        sum_to(t, wrap[0], (const uint32_t(*)[3])t->sums + row * (t->width + 1), a[0] + middle * d[0], value);
        for (int c = 0; c < 3; c++) sum[c] += share * value[c];
        from = fmax(to, from);
    }
}

/* The mean of 16 x 16 samples of a triangle or quad, whose area in the image is 0. */
static void mean_of_samples(const texture_table *t, const texture_wrap wrap[2], size_t n,
                            const double (*at)[2], double mean[3]) {
    enum { SIDE = 16 };
    mean[0] = mean[1] = mean[2] = 0;
    for (int i = 0; i < SIDE; i++)
        for (int j = 0; j < SIDE; j++) {
            /* Halves of a unit square, folded for a triangle. */
            double u = (i + .5) / SIDE, v = (j + .5) / SIDE, place[2];
            if (n == 3 && u + v > 1) u = 1 - u, v = 1 - v;
            for (int k = 0; k < 2; k++)
                place[k] = n == 3 ? at[0][k] + u * (at[1][k] - at[0][k]) + v * (at[2][k] - at[0][k])
                                  : (1 - v) * ((1 - u) * at[0][k] + u * at[1][k]) +
                                        v * ((1 - u) * at[3][k] + u * at[2][k]);
            const size_t x = wrapped(floor(place[0]), t->width, wrap[0]);
            const size_t y = wrapped(floor(place[1]), t->height, wrap[1]);
            const uint32_t(*row)[3] = (const uint32_t(*)[3])t->sums + y * (t->width + 1);
            for (int c = 0; c < 3; c++) mean[c] += (row[x + 1][c] - row[x][c]) * t->unit / (SIDE * SIDE);
        }
}

void texture_table_mean(const texture_table *t, const texture_wrap wrap[2], size_t n, const double (*uv)[2],
                        double mean[3]) {
    const double size[2] = {(double)t->width, (double)t->height};
    double at[4][2], extent = 0, doubled = 0, sum[3] = {0, 0, 0};
    assert(n >= 3 && n <= 4);
    for (int k = 0; k < 2; k++) {
        double low = uv[0][k], high = uv[0][k];
        for (size_t i = 1; i < n; i++) low = fmin(low, uv[i][k]), high = fmax(high, uv[i][k]);
        /* Whole periods off, so that small numbers are left. */
        const double period = wrap[k] == TEXTURE_MIRROR ? 2 : 1;
        const double off = wrap[k] == TEXTURE_CLAMP ? 0 : period * floor(low / period);
        for (size_t i = 0; i < n; i++) at[i][k] = (uv[i][k] - off) * size[k];
        extent = fmax(extent, (high - low) * size[k]);
    }
    for (size_t i = 1; i + 1 < n; i++)
        doubled += (at[i][0] - at[0][0]) * (at[i + 1][1] - at[0][1]) -
                   (at[i][1] - at[0][1]) * (at[i + 1][0] - at[0][0]);
    if (!(fabs(doubled) > 1e-9 * extent * extent + 1e-10)) {
        mean_of_samples(t, wrap, n, (const double(*)[2])at, mean);
        return;
    }
    for (size_t i = 0; i < n; i++) add_edge(t, wrap, at[i], at[(i + 1) % n], sum);
    for (int c = 0; c < 3; c++) mean[c] = fmin(fmax(2 * sum[c] * t->unit / doubled, 0), 1);
}

/* The gradient in the plane of a triangle of a value that differs by d1 and d2 along its edges e1 and e2. */
static void gradient(const double e1[3], const double e2[3], double d1, double d2, double out[3]) {
    const double a = e1[0] * e1[0] + e1[1] * e1[1] + e1[2] * e1[2];
    const double b = e1[0] * e2[0] + e1[1] * e2[1] + e1[2] * e2[2];
    const double c = e2[0] * e2[0] + e2[1] * e2[1] + e2[2] * e2[2];
    const double determinant = a * c - b * b;
    const double s = determinant > 0 ? (c * d1 - b * d2) / determinant : 0;
    const double r = determinant > 0 ? (a * d2 - b * d1) / determinant : 0;
    for (int k = 0; k < 3; k++) out[k] = s * e1[k] + r * e2[k];
}

void texture_affine(size_t corners, const double (*p)[3], const double *value, size_t stride, float out[4]) {
    double e[3][3], slope[3];
    for (int k = 0; k < 3; k++)
        for (size_t i = 1; i < corners; i++) e[i - 1][k] = p[i][k] - p[0][k];
    /* A quad counts as the triangle of its first, second and last corner. */
    gradient(e[0], e[corners - 2], value[stride] - value[0], value[(corners - 1) * stride] - value[0], slope);
    for (int k = 0; k < 4; k++) {
        out[k] = (float)(k < 3 ? slope[k] : value[0]);
        if (!isfinite(out[k])) out[k] = 0; /* the file's own, or of a sliver */
    }
}

double texture_value_at(const float f[4], const double origin[3], const double p[3]) {
    double value = (double)f[3];
    for (int k = 0; k < 3; k++) value += (double)f[k] * (p[k] - origin[k]);
    return value;
}

bool texture_is_affine(const double (*p)[3], const double *value, size_t stride) {
    float f[4];
    double low = value[0], high = value[0];
    texture_affine(4, p, value, stride, f);
    for (size_t i = 1; i < 4; i++) low = fmin(low, value[i * stride]), high = fmax(high, value[i * stride]);
    return fabs(texture_value_at(f, p[0], p[2]) - value[2 * stride]) <= 1e-3 * (high - low);
}

static float *quantity_of(mesh *m, int quantity) {
    return quantity == TEXTURE_REFLECTANCE ? m->reflectance : m->emission;
}

/* Multiplies the elements' values by the means of an image. */
static lam_status multiply_by_image(mesh *m, uint32_t image, lam_error *error) {
    const mesh_textures *t = m->textures;
    texture_table *table = NULL;
    for (size_t i = 0; i < m->n; i++) {
        if (m->textured_face[i] == TEXTURE_NONE) continue;
        const texture_face *face = &t->faces[m->textured_face[i]];
        const texture_surface *surface = &t->surfaces[face->surface];
        for (int q = 0; q < TEXTURE_QUANTITIES; q++) {
            double uv[4][2], mean[3];
            if (surface->image[q] != image) continue;
            if (table == NULL && texture_table_create(&t->images[image], &table, error) != LAM_OK)
                return LAM_ERR_MEMORY;
            const size_t corners = mesh_corners(m, i);
            for (size_t k = 0; k < corners; k++)
                for (int d = 0; d < 2; d++)
                    uv[k][d] = texture_value_at(face->uv[q][d], face->origin, m->vertices[m->elements[i][k]]);
            texture_table_mean(table, surface->wrap[q], corners, (const double(*)[2])uv, mean);
            for (size_t c = 0; c < m->n_channels; c++) quantity_of(m, q)[c * m->n + i] *= (float)mean[c];
        }
    }
    texture_table_free(table);
    return LAM_OK;
}

lam_status mesh_textures_apply(mesh *m, lam_error *error) {
    lam_status status = LAM_OK;
    mesh_textures *t = m->textures;
    if (t == NULL) return LAM_OK;
    for (size_t i = 0; i < m->n; i++) {
        if (m->textured_face[i] == TEXTURE_NONE) continue;
        const texture_face *face = &t->faces[m->textured_face[i]];
        const texture_surface *surface = &t->surfaces[face->surface];
        double centre[3];
        mesh_centroid(m, i, centre); /* where an affine value is its mean */
        for (size_t c = 0; c < m->n_channels; c++) {
            const double colour = fmin(fmax(texture_value_at(face->colour[c], face->origin, centre), 0), 1);
            m->reflectance[c * m->n + i] = (float)(surface->factor[TEXTURE_REFLECTANCE][c] * colour);
            m->emission[c * m->n + i] = (float)surface->factor[TEXTURE_EMISSION][c];
        }
    }
    for (uint32_t image = 0; image < t->n_images; image++) TRY(multiply_by_image(m, image, error));
    for (size_t k = 0; k < m->n * m->n_channels; k++) {
        const uint32_t face = m->textured_face[k % m->n];
        if (face == TEXTURE_NONE || !(m->reflectance[k] > (float)t->largest)) continue;
        m->reflectance[k] = (float)t->largest;
        t->surfaces[t->faces[face].surface].clamped = true;
    }
done:
    return status;
}

void mesh_textures_hold(mesh *m, mesh_textures *t) {
    if (t != NULL) t->holders++;
    m->textures = t;
}

void mesh_textures_release(mesh *m) {
    mesh_textures *t = m->textures;
    free(m->textured_face);
    m->textured_face = NULL;
    m->textures = NULL;
    if (t == NULL || --t->holders > 0) return;
    for (size_t k = 0; t->images != NULL && k < t->n_images; k++) free(t->images[k].pixels);
    free(t->images);
    free(t->surfaces);
    free(t->faces);
    free(t);
}
