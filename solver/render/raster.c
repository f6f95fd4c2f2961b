#include "solver/render/raster.h"

#include "solver/formfactor/visibility/pane_path.h"
#include "solver/render/shade.h"

#include <stdlib.h>
#include <string.h>

/* A ray that slips between two elements is cast again this far away, in pixels. */
#define SIDESTEP 0.02

enum { ROW_RAYS = RASTER_TILE * RASTER_SAMPLES_MOST };

/* The rays through one row of a tile, pixel by pixel. */
typedef struct ray_row {
    double x[ROW_RAYS], y[ROW_RAYS]; /* in the picture, 0 to 1 */
    uint32_t element[ROW_RAYS];
} ray_row;

static double sample_x(size_t i, size_t samples) {
    return ((double)i + .5) / (double)samples;
}

static double sample_y(size_t i, size_t samples) {
    size_t reversed = 0;
    for (size_t bit = 1; bit < samples; bit <<= 1) reversed = reversed << 1 | (i & bit ? 1u : 0u);
    return ((double)reversed + .5) / (double)samples;
}

static void aim(const raster_view *view, double x, double y, ray_packet *rays, size_t i) {
    float eye[3];
    double direction[3];
    visibility_recentre(view->visibility, view->camera->eye, eye);
    camera_direction(view->camera, x, y, direction);
    for (int d = 0; d < 3; d++) {
        rays->origin[d][i] = eye[d];
        rays->direction[d][i] = (float)direction[d];
    }
}

/* Casts n rays of the eye; elements are those that are seen. Panes are seen where nothing lies behind them.
 */
static void cast_eye(const raster_view *view, ray_packet *rays, size_t n, unsigned how, uint32_t *element) {
    const mesh *m = view->mesh;
    hit_packet hits;
    visibility_cast(view->visibility, rays, n, NULL, VISIBILITY_CULL_BACK | how, &hits);
    memcpy(element, hits.element, n * sizeof *element);
    for (int crossed = 0; m->glass != NULL && crossed < PANES_MOST; crossed++) {
        bool ahead[VISIBILITY_PACKET], any = false;
        for (size_t i = 0; i < n; i++) {
            ahead[i] = hits.element[i] != VISIBILITY_NOTHING && mesh_is_pane(m, hits.element[i]);
            any = any || ahead[i];
        }
        if (!any) return;
        pane_path_step(view->visibility, m, rays, n, ahead, VISIBILITY_CULL_BACK, &hits);
        for (size_t i = 0; i < n; i++)
            if (hits.element[i] != VISIBILITY_NOTHING) element[i] = hits.element[i];
    }
}

/* Elements that only touch leave gaps of rounding. In a pixel with hits, a miss is cast again a little
 * aside. */
static void cast_misses_again(const raster_view *view, ray_row *row, size_t first) {
    size_t missed = 0;
    for (size_t s = first; s < first + view->samples; s++) missed += row->element[s] == VISIBILITY_NOTHING;
    if (missed == view->samples) return;
    for (size_t s = first; s < first + view->samples && missed > 0; s++) {
        ray_packet rays;
        if (row->element[s] != VISIBILITY_NOTHING) continue;
        const double x = row->x[s] + SIDESTEP / (double)view->width,
                     y = row->y[s] + SIDESTEP / (double)view->height;
        memset(&rays, 0, sizeof rays);
        aim(view, x, y, &rays, 0);
        cast_eye(view, &rays, 1, 0, &row->element[s]);
        if (row->element[s] == VISIBILITY_NOTHING) continue;
        row->x[s] = x;
        row->y[s] = y;
    }
}

static void cast_row(const raster_view *view, size_t left, size_t right, size_t py, ray_row *row) {
    const size_t count = (right - left) * view->samples;
    for (size_t first = 0; first < count; first += VISIBILITY_PACKET) {
        const size_t now = count - first < VISIBILITY_PACKET ? count - first : VISIBILITY_PACKET;
        ray_packet rays;
        memset(&rays, 0, sizeof rays);
        for (size_t i = 0; i < now; i++) {
            const size_t k = first + i, px = left + k / view->samples, s = k % view->samples;
            row->x[k] = ((double)px + sample_x(s, view->samples)) / (double)view->width;
            row->y[k] = ((double)py + sample_y(s, view->samples)) / (double)view->height;
            aim(view, row->x[k], row->y[k], &rays, i);
        }
        cast_eye(view, &rays, now, VISIBILITY_TOGETHER, row->element + first);
    }
    for (size_t first = 0; first < count; first += view->samples) cast_misses_again(view, row, first);
}

/* The point where the ray through (x, y) meets the plane of an element, in double. */
static void point_of(const raster_view *view, double x, double y, uint32_t element, double point[3]) {
    const mesh *m = view->mesh;
    const camera *c = view->camera;
    const double *corner = m->vertices[m->elements[element][0]];
    double direction[3], along = 0, away = 0;
    camera_direction(c, x, y, direction);
    for (int d = 0; d < 3; d++) {
        away += (double)m->normal[element][d] * (corner[d] - c->eye[d]);
        along += (double)m->normal[element][d] * direction[d];
    }
    for (int d = 0; d < 3; d++) point[d] = c->eye[d] + (along != 0 ? away / along : 0) * direction[d];
}

/* Puts the rays of one pixel together by elements, in the order in which these come; returns the number of
 * parts. The middle of a part is the mean of its points: within one element light is nearly linear in a
 * pixel. */
static size_t gather_parts(const raster_view *view, const ray_row *row, size_t first, raster_part *parts,
                           double (*middle)[3]) {
    size_t n = 0;
    for (size_t s = first; s < first + view->samples; s++) {
        const uint32_t element = row->element[s];
        double point[3];
        size_t k = 0;
        while (k < n && parts[k].element != element) k++;
        if (k == n) {
            parts[n++] = (raster_part){.element = element};
            memset(middle[k], 0, sizeof middle[k]);
        }
        parts[k].rays++;
        if (!view->smooth || element == VISIBILITY_NOTHING) continue;
        point_of(view, row->x[s], row->y[s], element, point);
        for (int d = 0; d < 3; d++) middle[k][d] += point[d];
    }
    for (size_t k = 0; k < n; k++)
        for (int d = 0; d < 3; d++) middle[k][d] /= parts[k].rays;
    return n;
}

/* Makes the arrays of a tile as small as what they hold. */
static lam_status tile_keep(size_t n_parts, raster_tile *tile, const raster_part *parts,
                            const float (*weights)[4], lam_error *error) {
    tile->parts = memory_allocate(n_parts, sizeof *tile->parts, "a picture's elements", error);
    if (tile->parts == NULL) return LAM_ERR_MEMORY;
    memcpy(tile->parts, parts, n_parts * sizeof *parts);
    if (weights == NULL) return LAM_OK;
    tile->weights = memory_allocate(n_parts, sizeof *tile->weights, "a picture's elements", error);
    if (tile->weights == NULL) return LAM_ERR_MEMORY;
    memcpy(tile->weights, weights, n_parts * sizeof *weights);
    return LAM_OK;
}

lam_status raster_tile_create(const raster_view *view, raster_tile *tile, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t wide = tile->right - tile->left, n_pixels = wide * (tile->bottom - tile->top);
    const char *const what = "a picture's elements";
    raster_part *parts = memory_allocate(n_pixels, view->samples * sizeof *parts, what, error);
    float(*weights)[4] = NULL;
    ray_row *row = memory_allocate(1, sizeof *row, what, error);
    size_t n = 0;
    tile->from = memory_allocate(n_pixels + 1, sizeof *tile->from, what, error);
    if (view->smooth) weights = memory_allocate(n_pixels, view->samples * sizeof *weights, what, error);
    if (parts == NULL || row == NULL || tile->from == NULL || (view->smooth && weights == NULL))
        TRY(LAM_ERR_MEMORY);
    for (size_t y = tile->top; y < tile->bottom; y++) {
        cast_row(view, tile->left, tile->right, y, row);
        for (size_t x = 0; x < wide; x++) {
            double middle[RASTER_SAMPLES_MOST][3];
            const size_t found = gather_parts(view, row, x * view->samples, parts + n, middle);
            for (size_t k = 0; k < found && view->smooth; k++)
                if (parts[n + k].element != VISIBILITY_NOTHING)
                    shade_weights(view->mesh, parts[n + k].element, middle[k], weights[n + k]);
            n += found;
            tile->from[(y - tile->top) * wide + x + 1] = (uint32_t)n;
        }
    }
    TRY(tile_keep(n, tile, parts, (const float(*)[4])weights, error));
done:
    free(parts);
    free(weights);
    free(row);
    return status;
}

void raster_tile_free(raster_tile *tile) {
    free(tile->from);
    free(tile->parts);
    free(tile->weights);
    *tile = (raster_tile){0};
}

static size_t tiles_across(const raster_view *view) {
    return (view->width + RASTER_TILE - 1) / RASTER_TILE;
}

size_t raster_tiles(const raster_view *view) {
    return tiles_across(view) * ((view->height + RASTER_TILE - 1) / RASTER_TILE);
}

raster_tile raster_tile_at(const raster_view *view, size_t index) {
    const size_t left = index % tiles_across(view) * RASTER_TILE,
                 top = index / tiles_across(view) * RASTER_TILE;
    const size_t right = left + RASTER_TILE, bottom = top + RASTER_TILE;
    return (raster_tile){.left = left,
                         .top = top,
                         .right = right < view->width ? right : view->width,
                         .bottom = bottom < view->height ? bottom : view->height};
}

lam_status raster_create(const raster_view *view, const progress *waiting, raster *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n_tiles = raster_tiles(view);
    size_t done = 0;
    *out = (raster){.width = view->width, .height = view->height, .samples = view->samples};
    out->tiles = memory_allocate(n_tiles, sizeof *out->tiles, "a picture's elements", error);
    if (out->tiles == NULL) return LAM_ERR_MEMORY;
    out->n_tiles = n_tiles;
#pragma omp parallel for schedule(dynamic)
    for (size_t t = 0; t < n_tiles; t++) {
        lam_error own = {0};
        if (progress_cancelled(waiting)) continue;
        out->tiles[t] = raster_tile_at(view, t);
        const lam_status made = raster_tile_create(view, &out->tiles[t], &own);
#pragma omp critical(raster_progress)
        {
            done++;
            if (made != LAM_OK) {
                status = made;
                if (error != NULL) *error = own;
            }
            progress_report(waiting, "looking", (double)done / (double)n_tiles);
        }
    }
    if (status == LAM_OK && done < n_tiles) status = status_fail(error, LAM_ERR_CANCELLED, "cancelled");
    return status;
}

void raster_free(raster *r) {
    for (size_t t = 0; t < r->n_tiles; t++) raster_tile_free(&r->tiles[t]);
    free(r->tiles);
    *r = (raster){0};
}
