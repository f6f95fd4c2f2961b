/* The list of generated scenes, and the simple ones: boxes. */
#include "solver/scene/generate/generate.h"
#include "solver/base/nearest.h"
#include "solver/scene/face_grid.h"
#include "solver/scene/generate/scene_draft.h"

#include <math.h>
#include <string.h>

static const size_t most_faces = 50000000;

/* The six faces of a box by its corners (bit 0: x, bit 1: y, bit 2: z), counter-clockwise seen from outside.
 */
static const int box_faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 4, 6, 2},
                                    {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}};
enum { BOX_FLOOR, BOX_CEILING, BOX_X0, BOX_X1, BOX_Y0, BOX_Y1 };

static const scene_draft_material half_grey = {"grey", {.5, .5, .5}, {0, 0, 0}};

/* Face number of a box from 0 to size; seen from inside. */
static void room_face(const double size[3], int number, double quad[4][3]) {
    for (int k = 0; k < 4; k++) {
        const int corner = box_faces[number][3 - k];
        for (int axis = 0; axis < 3; axis++) quad[k][axis] = corner >> axis & 1 ? size[axis] : 0;
    }
}

static const char *const room_groups[6] = {
    [BOX_FLOOR] = "floor", [BOX_CEILING] = "ceiling", [BOX_X0] = "wall-x0",
    [BOX_X1] = "wall-x1",  [BOX_Y0] = "wall-y0",      [BOX_Y1] = "wall-y1"};

lam_status generate_box(scene_draft *d, const generate_options *options, lam_error *error) {
    lam_status status = LAM_OK;
    for (int axis = 0; axis < 3; axis++)
        if (!(options->size[axis] > 0) || !(options->size[axis] < 1e6))
            FAIL(error, LAM_ERR_ARGUMENT, "box: size[%d] = %g m, must be positive and below 1e6", axis,
                 options->size[axis]);
    if (options->divisions > 0 && options->elements > 0)
        FAIL(error, LAM_ERR_ARGUMENT, "box: give divisions or elements, not both");
    size_t m = options->divisions > 0 ? options->divisions : 1;
    if (options->elements > 0) { /* the M whose 6 M^2 is nearest */
        m = (size_t)sqrt((double)options->elements / 6);
        if (m == 0 || options->elements - 6 * m * m > 6 * (m + 1) * (m + 1) - options->elements) m++;
    }
    if (m > most_faces || 6 * m * m > most_faces)
        FAIL(error, LAM_ERR_ARGUMENT, "box: %zu divisions would make more than %zu faces", m, most_faces);
    for (int number = 0; number < 6; number++) {
        double quad[4][3];
        room_face(options->size, number, quad);
        TRY(scene_draft_group(d, room_groups[number], &half_grey, error));
        TRY(scene_draft_grid(d, (const double(*)[3])quad, m, m, error));
    }
done:
    return status;
}

/* A block from low to high, turned by angle about the vertical through its middle; seen from outside. */
typedef struct floating_block {
    const char *name;
    double low[3], high[3], angle;
} floating_block;

static const double furnace_size[3] = {4, 3, 2.5};
static const floating_block furnace_blocks[] = {
    {"block-1", {.7, .5, .4}, {1.5, 1.3, 1.2}, 0},
    {"block-2", {2.3, 1.4, .9}, {3.3, 2.1, 1.9}, .5},
    {"block-3", {.6, 1.9, 1.3}, {1.2, 2.5, 1.6}, 1.1},
};

static lam_status furnace_cells(scene_draft *d, const generate_options *options, double cell,
                                lam_error *error) {
    lam_status status = LAM_OK;
    (void)options;
    for (int number = 0; number < 6; number++) {
        double quad[4][3];
        room_face(furnace_size, number, quad);
        TRY(scene_draft_group(d, room_groups[number], &half_grey, error));
        TRY(scene_draft_cells(d, (const double(*)[3])quad, cell, error));
    }
    for (size_t b = 0; b < sizeof furnace_blocks / sizeof *furnace_blocks; b++) {
        const floating_block *block = &furnace_blocks[b];
        const double middle[2] = {(block->low[0] + block->high[0]) / 2, (block->low[1] + block->high[1]) / 2};
        TRY(scene_draft_group(d, block->name, &half_grey, error));
        for (int number = 0; number < 6; number++) {
            double quad[4][3];
            for (int k = 0; k < 4; k++) {
                const int corner = box_faces[number][k];
                const double x = (corner & 1 ? block->high : block->low)[0] - middle[0];
                const double y = (corner & 2 ? block->high : block->low)[1] - middle[1];
                quad[k][0] = middle[0] + cos(block->angle) * x - sin(block->angle) * y;
                quad[k][1] = middle[1] + sin(block->angle) * x + cos(block->angle) * y;
                quad[k][2] = (corner & 4 ? block->high : block->low)[2];
            }
            TRY(scene_draft_cells(d, (const double(*)[3])quad, cell, error));
        }
    }
done:
    return status;
}

lam_status generate_furnace(scene_draft *d, const generate_options *options, lam_error *error) {
    return scene_draft_build_near(d, furnace_cells, options, options->elements > 0 ? options->elements : 1000,
                                  error);
}

static const struct {
    const char *name;
    lam_status (*build)(scene_draft *d, const generate_options *options, lam_error *error);
} kinds[] = {
    {"box", generate_box},       {"cornell", generate_cornell}, {"furnace", generate_furnace},
    {"city", generate_city},     {"rooms", generate_rooms},     {"anechoic", generate_anechoic},
    {"patio", generate_patio},   {"atrium", generate_atrium},   {"maze", generate_maze},
    {"canopy", generate_canopy},
};
#define N_KINDS (sizeof kinds / sizeof *kinds)

const char *generate_kind(size_t k) {
    return k < N_KINDS ? kinds[k].name : NULL;
}

static lam_status no_such_scene(const char *word, lam_error *error) {
    const char *names[N_KINDS];
    char advice[256];
    for (size_t k = 0; k < N_KINDS; k++) names[k] = kinds[k].name;
    nearest_advice(word, N_KINDS, names, advice, sizeof advice);
    return status_fail(error, LAM_ERR_ARGUMENT, "%.40s: no such scene; %s", word, advice);
}

lam_status scene_generate(const generate_options *options, const char *path, size_t *faces,
                          lam_error *error) {
    lam_status status = LAM_OK;
    scene_draft d = {0};
    size_t kind = 0;
    while (kind < N_KINDS && strcmp(kinds[kind].name, options->kind) != 0) kind++;
    if (kind == N_KINDS) TRY(no_such_scene(options->kind, error));
    if (isnan(options->reflectance) || options->reflectance >= 1)
        FAIL(error, LAM_ERR_ARGUMENT, "reflectance = %g, must be in [0, 1)", options->reflectance);
    if (options->elements > most_faces)
        FAIL(error, LAM_ERR_ARGUMENT, "elements = %zu, at most %zu can be generated", options->elements,
             most_faces);
    TRY(kinds[kind].build(&d, options, error));
    TRY(scene_draft_write(&d, path, options->reflectance, error));
    if (faces != NULL) *faces = d.n_faces;
done:
    scene_draft_free(&d);
    return status;
}
