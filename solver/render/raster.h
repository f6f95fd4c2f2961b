/* The elements behind the pixels of a picture. Light does not change them: found once, they are shaded for
 * any number of frames. */
#ifndef LAMBERT_RENDER_RASTER_H
#define LAMBERT_RENDER_RASTER_H

#include "solver/base/progress.h"
#include "solver/render/camera.h"

/* Rays of a pixel of a picture unless others are asked for, and the most. 2^m of them are placed as a (0, m,
 * 2)-net in base 2, with one point in each elementary cell. */
#define RASTER_SAMPLES 16
#define RASTER_SAMPLES_MOST 64

/* The picture that is looked at. The mesh, its visibility and the camera are borrowed. */
typedef struct raster_view {
    const mesh *mesh;
    const visibility *visibility;
    const camera *camera;
    size_t width, height; /* pixels */
    size_t samples;       /* rays of a pixel: a power of two */
    bool smooth;          /* light varies inside elements: find the weights of their corners */
} raster_view;

/* The share of a pixel that shows one element. */
typedef struct raster_part {
    uint32_t element; /* VISIBILITY_NOTHING: the background */
    uint32_t rays;    /* of the pixel */
} raster_part;

/* A rectangle of pixels. Pixel (x, y) has the parts from[k] ... from[k + 1] - 1 with
 * k = (y - top) (right - left) + x - left. */
typedef struct raster_tile {
    size_t left, top, right, bottom;
    uint32_t *from;
    raster_part *parts;
    float (*weights)[4]; /* of the corners at the middle of a part, for shade_mix; NULL unless smooth */
} raster_tile;

/* Casts the rays of the pixels whose rectangle *tile names, at most RASTER_TILE on a side, and fills the
 * rest; freed by raster_tile_free, also after an error. Errors: LAM_ERR_MEMORY. */
#define RASTER_TILE 32
lam_status raster_tile_create(const raster_view *view, raster_tile *tile, lam_error *error);
void raster_tile_free(raster_tile *tile);

/* A whole picture: its tiles, row by row. */
typedef struct raster {
    size_t width, height, samples;
    size_t n_tiles;
    raster_tile *tiles;
} raster;

/* The number of tiles of a picture, and the rectangle of one of them. */
size_t raster_tiles(const raster_view *view);
raster_tile raster_tile_at(const raster_view *view, size_t index);

/* All tiles of a view, found by all threads; freed by raster_free, also after an error. Memory: 8 bytes a
 * part and 4 a pixel, 24 and 4 of a smooth one; a pixel has mostly one part, at most as many as rays. Errors:
 * LAM_ERR_CANCELLED, LAM_ERR_MEMORY. */
lam_status raster_create(const raster_view *view, const progress *waiting, raster *out, lam_error *error);
void raster_free(raster *r);

#endif
