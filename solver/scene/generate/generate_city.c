/* Cities in the manner of "Aguerre 2016, section 4.3.1", one plan and three distributions of heights, on the
 * three terrains of its section 4.3.5. Buildings are open below: nothing sees the ground under them. */
#include "solver/scene/face_grid.h"
#include "solver/scene/generate/city_plan.h"
#include "solver/scene/generate/scene_draft.h"

#include <math.h>
#include <string.h>

/* The whole city, and what a block takes at least before cells grow longer than houses: a city of fewer
 * elements has fewer blocks. As in the thesis, finer cities divide each cell of the coarsest into four, once
 * or more often. */
enum { BLOCKS_PER_SIDE = 7, LEAST_PER_BLOCK = 160, THESIS_ELEMENTS = 35588 };

/* How cells are made: of about size^2 (metres), each cut into parts x parts. */
typedef struct cell_rule {
    double size;
    size_t parts;
} cell_rule;

static const draft_material grey = {"grey", {.7, .7, .7}, {0, 0, 0}};

/* Cells of about size^2: the shorter side is rounded first and the other makes up for it, up to cells twice
 * as long as wide. */
static lam_status add_cells(draft *d, const double quad[4][3], const cell_rule *cells, lam_error *error) {
    const double size = cells->size;
    const double along = (point_distance(quad[0], quad[1]) + point_distance(quad[3], quad[2])) / 2;
    const double across = (point_distance(quad[0], quad[3]) + point_distance(quad[1], quad[2])) / 2;
    const double shorter = fmin(along, across), longer = fmax(along, across);
    const size_t n_shorter = draft_steps_along(d, shorter, size);
    const double width = shorter / (double)n_shorter;
    const size_t n_longer = draft_steps_along(d, longer, fmin(size * size / width, 2 * width));
    const size_t na = cells->parts * (along < across ? n_shorter : n_longer),
                 nb = cells->parts * (along < across ? n_longer : n_shorter);
    if (!d->counting) return draft_grid(d, quad, na, nb, error);
    d->n_faces += na * nb;
    return LAM_OK;
}

/* On the ground, front upwards. */
static void ground_quad(const city_plan *plan, const city_rectangle *r, double quad[4][3]) {
    for (int k = 0; k < 4; k++) {
        quad[k][0] = k == 1 || k == 2 ? r->high[0] : r->low[0];
        quad[k][1] = k >= 2 ? r->high[1] : r->low[1];
        quad[k][2] = city_ground(plan, quad[k][0], quad[k][1]);
    }
}

/* A roof is as steep as the ground under it: the thesis skews its cities onto their terrains. */
static void roof_quad(const double foot[4][3], double height, double quad[4][3]) {
    memcpy(quad, foot, 4 * sizeof *foot);
    for (int k = 0; k < 4; k++) quad[k][2] += height;
}

static lam_status add_ground(draft *d, const city_plan *plan, const city_rectangles *all,
                             const cell_rule *cells, lam_error *error) {
    lam_status status = LAM_OK;
    double quad[4][3];
    for (size_t i = 0; i < all->n; i++) {
        ground_quad(plan, &all->items[i], quad);
        TRY(add_cells(d, (const double(*)[3])quad, cells, error));
    }
done:
    return status;
}

static lam_status add_buildings(draft *d, const city_plan *plan, bool roofs, const cell_rule *cells,
                                lam_error *error) {
    lam_status status = LAM_OK;
    double foot[4][3], roof[4][3];
    for (size_t b = 0; b < plan->buildings.n; b++) {
        ground_quad(plan, &plan->buildings.items[b], foot);
        roof_quad((const double(*)[3])foot, plan->heights[b], roof);
        if (roofs) TRY(add_cells(d, (const double(*)[3])roof, cells, error));
        for (int k = 0; k < 4 && !roofs; k++) {
            double wall[4][3];
            memcpy(wall[0], foot[k], sizeof *wall);
            memcpy(wall[1], foot[(k + 1) % 4], sizeof *wall);
            memcpy(wall[2], roof[(k + 1) % 4], sizeof *wall);
            memcpy(wall[3], roof[k], sizeof *wall);
            TRY(add_cells(d, (const double(*)[3])wall, cells, error));
        }
    }
done:
    return status;
}

static size_t wanted_elements(const generate_options *options) {
    return options->elements > 0 ? options->elements : THESIS_ELEMENTS;
}

/* Whether a whole city of cells cut into parts x parts has enough of them. */
static bool coarsest_fits(size_t wanted, size_t parts) {
    return wanted / (parts * parts) >= (size_t)BLOCKS_PER_SIDE * BLOCKS_PER_SIDE * LEAST_PER_BLOCK;
}

static lam_status city_cells(draft *d, const generate_options *options, double size, lam_error *error) {
    lam_status status = LAM_OK;
    city_plan plan = {0};
    size_t blocks = BLOCKS_PER_SIDE;
    cell_rule cells = {.size = size, .parts = 1};
    while (blocks > 1 && blocks * blocks * LEAST_PER_BLOCK > wanted_elements(options)) blocks--;
    while (coarsest_fits(wanted_elements(options), 2 * cells.parts)) cells.parts *= 2;
    TRY(city_plan_make(options, blocks, &plan, error));
    TRY(draft_group(d, "street", &grey, error));
    TRY(add_ground(d, &plan, &plan.streets, &cells, error));
    TRY(draft_group(d, "yard", &grey, error));
    TRY(add_ground(d, &plan, &plan.yards, &cells, error));
    TRY(draft_group(d, "facade", &grey, error));
    TRY(add_buildings(d, &plan, false, &cells, error));
    TRY(draft_group(d, "roof", &grey, error));
    TRY(add_buildings(d, &plan, true, &cells, error));
done:
    city_plan_free(&plan);
    return status;
}

lam_status draft_city_scene(draft *d, const generate_options *options, lam_error *error) {
    lam_status status = LAM_OK;
    const char *terrain = options->terrain == NULL ? "(none)" : options->terrain;
    if (options->variant < 1 || options->variant > 3)
        FAIL(error, LAM_ERR_ARGUMENT, "city: variant = %u, must be 1, 2 or 3", options->variant);
    if (strcmp(terrain, "flat") != 0 && strcmp(terrain, "valley") != 0 && strcmp(terrain, "hill") != 0)
        FAIL(error, LAM_ERR_ARGUMENT, "city: terrain = '%s', must be flat, valley or hill", terrain);
    TRY(draft_build_near(d, city_cells, options, wanted_elements(options), error));
done:
    return status;
}
