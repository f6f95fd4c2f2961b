/* The measured Cornell box: published corners in millimetres, turned so that z is up and the open front looks
 * along -y; the room is squared (the published walls lean by up to 6.4 mm, which four corners cannot do in a
 * plane). */
#include "solver/base/array_grow.h"
#include "solver/scene/generate/convex.h"
#include "solver/scene/generate/scene_draft.h"

#include <stdlib.h>
#include <string.h>

static const double width = .556, depth = .5592, height = .5488;
static const double lamp_x[2] = {.213, .343}, lamp_y[2] = {.227, .332};

/* Tops of the blocks as published: from the left wall's side (x runs to the left there), and depth. */
static const struct {
    const char *name;
    double top[4][2], height;
} blocks[2] = {
    {"short-block", {{130, 65}, {82, 225}, {240, 272}, {290, 114}}, .165},
    {"tall-block", {{423, 247}, {265, 296}, {314, 456}, {472, 406}}, .330},
};

static const scene_draft_material white = {"white", {.725, .71, .68}, {0, 0, 0}};
static const scene_draft_material red = {"red", {.63, .065, .05}, {0, 0, 0}};
static const scene_draft_material green = {"green", {.14, .45, .091}, {0, 0, 0}};
static const scene_draft_material light = {"light", {.78, .78, .78}, {17, 12, 4}};

/* The footprint of a block, counter-clockwise seen from above. */
static convex footprint(size_t b) {
    convex out = {.n = 4};
    for (size_t k = 0; k < 4; k++) { /* mirroring x turns the published order round */
        out.p[k][0] = (556 - blocks[b].top[k][0]) / 1000;
        out.p[k][1] = blocks[b].top[k][1] / 1000;
    }
    if (convex_area(&out) > 0) return out;
    for (size_t k = 0; k < 2; k++) {
        double swap[2];
        memcpy(swap, out.p[k], sizeof swap);
        memcpy(out.p[k], out.p[3 - k], sizeof swap);
        memcpy(out.p[3 - k], swap, sizeof swap);
    }
    return out;
}

static bool boxes_overlap(const convex *a, const convex *b) {
    for (int k = 0; k < 2; k++) {
        double low[2] = {1e9, 1e9}, high[2] = {-1e9, -1e9};
        const convex *both[2] = {a, b};
        for (int s = 0; s < 2; s++)
            for (size_t i = 0; i < both[s]->n; i++) {
                const double x = both[s]->p[i][k];
                low[s] = x < low[s] ? x : low[s];
                high[s] = x > high[s] ? x : high[s];
            }
        if (high[0] <= low[1] || high[1] <= low[0]) return false;
    }
    return true;
}

/* The floor's cells minus the footprints: the pieces of cell c are first[c] .. first[c + 1] - 1; a piece that
 * was merged into another one has no corners. */
typedef struct cut_floor {
    size_t nx, ny, *first;
    convex *pieces;
    size_t n, capacity;
} cut_floor;

/* Most pieces of one cell: each footprint leaves at most 4 of every piece. */
#define CELL_PIECES 16

static lam_status cut_cell(cut_floor *left, const convex *cell, const convex feet[2], double tiny,
                           lam_error *error) {
    convex now[CELL_PIECES] = {*cell}, next[CELL_PIECES];
    size_t n = 1;
    for (int b = 0; b < 2; b++) {
        size_t n_next = 0;
        for (size_t i = 0; i < n; i++)
            if (boxes_overlap(&now[i], &feet[b]))
                n_next += convex_subtract(&now[i], &feet[b], tiny, next + n_next);
            else
                next[n_next++] = now[i];
        memcpy(now, next, n_next * sizeof *next);
        n = n_next;
    }
    if (array_grow(&left->pieces, &left->capacity, left->n + n, sizeof *left->pieces, "floor", error) !=
        LAM_OK)
        return LAM_ERR_MEMORY;
    memcpy(left->pieces + left->n, now, n * sizeof *now);
    left->n += n;
    return LAM_OK;
}

/* Joins piece i of the cell at (x, y) to another of the same or a neighbouring cell where that stays a convex
 * quad. */
static void merge_piece(cut_floor *left, size_t x, size_t y, size_t i) {
    static const int steps[5][2] = {{0, 0}, {-1, 0}, {1, 0}, {0, -1}, {0, 1}};
    for (int s = 0; s < 5; s++) {
        const size_t x2 = x + (size_t)steps[s][0], y2 = y + (size_t)steps[s][1]; /* -1 wraps beyond nx, ny */
        if (x2 >= left->nx || y2 >= left->ny) continue;
        const size_t cell = y2 * left->nx + x2;
        for (size_t j = left->first[cell]; j < left->first[cell + 1]; j++)
            if (j != i && left->pieces[j].n > 0 &&
                convex_merge(&left->pieces[j], &left->pieces[i], 1e-10, &left->pieces[j])) {
                left->pieces[i].n = 0;
                return;
            }
    }
}

static lam_status add_floor(scene_draft *d, double size, lam_error *error) {
    lam_status status = LAM_OK;
    cut_floor left = {.nx = scene_draft_steps_along(d, width, size),
                      .ny = scene_draft_steps_across(d, depth, size)};
    const double dx = width / (double)left.nx, dy = depth / (double)left.ny;
    const convex feet[2] = {footprint(0), footprint(1)};
    left.first = memory_allocate(left.nx * left.ny + 1, sizeof *left.first, "floor", error);
    if (left.first == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t y = 0; y < left.ny; y++)
        for (size_t x = 0; x < left.nx; x++) {
            const double x0 = width * (double)x / (double)left.nx,
                         x1 = width * (double)(x + 1) / (double)left.nx;
            const double y0 = depth * (double)y / (double)left.ny,
                         y1 = depth * (double)(y + 1) / (double)left.ny;
            const convex cell = {.n = 4, .p = {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}}};
            TRY(cut_cell(&left, &cell, feet, 1e-9 * dx * dy, error));
            left.first[y * left.nx + x + 1] = left.n;
        }
    for (size_t y = 0; y < left.ny; y++)
        for (size_t x = 0; x < left.nx; x++)
            for (size_t i = left.first[y * left.nx + x]; i < left.first[y * left.nx + x + 1]; i++)
                if (convex_area(&left.pieces[i]) < .05 * dx * dy) merge_piece(&left, x, y, i);
    for (size_t i = 0; i < left.n; i++) {
        convex faces[CONVEX_MOST];
        const size_t n = left.pieces[i].n == 0 ? 0 : convex_split(&left.pieces[i], faces);
        for (size_t f = 0; f < n; f++) {
            double corners[4][3] = {{0}};
            for (size_t k = 0; k < faces[f].n; k++) memcpy(corners[k], faces[f].p[k], sizeof faces[f].p[k]);
            TRY(scene_draft_face(d, (const double(*)[3])corners, faces[f].n, error));
        }
    }
done:
    free(left.first);
    free(left.pieces);
    return status;
}

/* An upright wall from (x0, y0) to (x1, y1); its front is on the right of that way. */
static lam_status add_wall(scene_draft *d, double x0, double y0, double x1, double y1, double high,
                           double size, lam_error *error) {
    const double quad[4][3] = {{x0, y0, 0}, {x1, y1, 0}, {x1, y1, high}, {x0, y0, high}};
    return scene_draft_cells(d, quad, size, error);
}

/* The ceiling's grid lines follow the lamp, which fills its hole exactly. */
static lam_status add_ceiling(scene_draft *d, double size, bool lamp, lam_error *error) {
    lam_status status = LAM_OK;
    const double x[4] = {0, lamp_x[0], lamp_x[1], width}, y[4] = {0, lamp_y[0], lamp_y[1], depth};
    for (int j = 0; j < 3; j++)
        for (int i = 0; i < 3; i++) {
            if ((i == 1 && j == 1) != lamp) continue;
            const double quad[4][3] = {{x[i], y[j], height},
                                       {x[i], y[j + 1], height},
                                       {x[i + 1], y[j + 1], height},
                                       {x[i + 1], y[j], height}};
            TRY(scene_draft_cells(d, quad, size, error));
        }
done:
    return status;
}

static lam_status cornell_cells(scene_draft *d, const generate_options *options, double size,
                                lam_error *error) {
    lam_status status = LAM_OK;
    TRY(scene_draft_group(d, "floor", &white, error));
    TRY(add_floor(d, size, error));
    TRY(scene_draft_group(d, "ceiling", &white, error));
    TRY(add_ceiling(d, size, false, error));
    TRY(scene_draft_group(d, "back-wall", &white, error));
    TRY(add_wall(d, 0, depth, width, depth, height, size, error));
    TRY(scene_draft_group(d, "left-wall", &red, error));
    TRY(add_wall(d, 0, 0, 0, depth, height, size, error));
    TRY(scene_draft_group(d, "right-wall", &green, error));
    TRY(add_wall(d, width, depth, width, 0, height, size, error));
    if (options->closed) {
        TRY(scene_draft_group(d, "front-wall", &white, error));
        TRY(add_wall(d, width, 0, 0, 0, height, size, error));
    }
    TRY(scene_draft_group(d, "lamp", &light, error));
    TRY(add_ceiling(d, size, true, error));
    for (size_t b = 0; b < 2; b++) {
        const convex foot = footprint(b);
        double top[4][3];
        for (size_t k = 0; k < 4; k++) {
            top[k][0] = foot.p[k][0];
            top[k][1] = foot.p[k][1];
            top[k][2] = blocks[b].height;
        }
        TRY(scene_draft_group(d, blocks[b].name, &white, error));
        TRY(scene_draft_cells(d, (const double(*)[3])top, size, error));
        for (size_t k = 0; k < 4; k++) {
            const double *from = foot.p[k], *to = foot.p[(k + 1) % 4];
            TRY(add_wall(d, from[0], from[1], to[0], to[1], blocks[b].height, size, error));
        }
    }
done:
    return status;
}

lam_status generate_cornell(scene_draft *d, const generate_options *options, lam_error *error) {
    return scene_draft_build_near(d, cornell_cells, options, options->elements > 0 ? options->elements : 2560,
                                  error);
}
