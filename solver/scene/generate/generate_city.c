/* Cities in the manner of "Aguerre 2016, section 4.3.1", one plan and three distributions of heights, on the
 * three terrains of its section 4.3.5. Buildings are open below: nothing sees the ground under them. */
#include "solver/base/array_grow.h"
#include "solver/base/random.h"
#include "solver/scene/face_grid.h"
#include "solver/scene/generate/scene_draft.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Seen from above: x, then y. */
typedef struct city_rectangle {
    double low[2], high[2];
} city_rectangle;

typedef struct city_rectangles {
    city_rectangle *items;
    size_t n, capacity;
} city_rectangles;

/* The streets and blocks along x or y: a street from at[0] to at[1], blocks to at[2], and so on to a last
 * street. */
typedef struct city_axis {
    double *at, *rise; /* [n]; metres; the ground is straight between two of them */
    size_t n;
} city_axis;

typedef struct city_plan {
    city_axis axes[2];
    city_rectangles streets, yards, buildings; /* each within one cell of the axes; together the whole site */
    double *heights;                           /* [buildings.n], metres above the ground */
} city_plan;

/* Metres. The number of elements that an element sees depends on the number of blocks, the depth of the
 * streets and the differences of roof heights. These and the slopes are chosen so that the density of F is
 * within 15 % of Aguerre 2016, tables 4.1 and 4.5, counted as there; `lambert bench cities` prints both. */
static const double avenue = 14, street[2] = {9, 13}, block_side[2] = {45, 65}, alley_width[2] = {3, 5};
static const double largest_lot = 22, empty_share = .05;

/* The rise of the ground over half a side of the site, and its profile along x and along y, t from -1 to 1: a
 * bowl; a hill with a foot. */
static const double valley_slope = .12, hill_slope = .1;

/* The distribution of heights, low + middle u + top u^power for u from 0 to 1, by variant: flat houses; low
 * and medium-high ones; all sizes, with a few skyscrapers. */
static const struct {
    double low, middle, top, power;
} variants[3] = {{5, 1.2, 0, 1}, {7, 6, 0, 1}, {21, 5, 36, 70}};

static lam_status rectangle_add(city_rectangles *all, city_rectangle one, lam_error *error) {
    if (array_grow(&all->items, &all->capacity, all->n + 1, sizeof *all->items, "the plan of a city",
                   error) != LAM_OK)
        return LAM_ERR_MEMORY;
    all->items[all->n++] = one;
    return LAM_OK;
}

/* Cuts a part of a block by alleys until it is a lot. A lot that touches no street is a courtyard, and a few
 * others stay empty. */
static lam_status divide_block(city_plan *plan, uint64_t *r, const city_rectangle *block, city_rectangle part,
                               lam_error *error) {
    lam_status status = LAM_OK;
    const double side[2] = {part.high[0] - part.low[0], part.high[1] - part.low[1]};
    const int axis = side[1] > side[0];
    if (side[axis] > largest_lot) {
        const double alley = random_between(r, alley_width[0], alley_width[1]);
        const double cut = part.low[axis] + (side[axis] - alley) * random_between(r, .38, .62);
        city_rectangle low = part, between = part, high = part;
        low.high[axis] = between.low[axis] = cut;
        between.high[axis] = high.low[axis] = cut + alley;
        TRY(rectangle_add(&plan->yards, between, error));
        TRY(divide_block(plan, r, block, low, error));
        TRY(divide_block(plan, r, block, high, error));
    } else {
        const bool court = part.low[0] > block->low[0] && part.high[0] < block->high[0] &&
                           part.low[1] > block->low[1] && part.high[1] < block->high[1];
        const bool empty = random_unit(r) < empty_share;
        TRY(rectangle_add(court || empty ? &plan->yards : &plan->buildings, part, error));
    }
done:
    return status;
}

static lam_status make_axis(city_axis *axis, size_t blocks, uint64_t r, const char *terrain,
                            lam_error *error) {
    lam_status status = LAM_OK;
    axis->n = 2 * blocks + 2;
    axis->at = memory_allocate(axis->n, sizeof *axis->at, "the plan of a city", error);
    axis->rise = memory_allocate(axis->n, sizeof *axis->rise, "the plan of a city", error);
    if (axis->at == NULL || axis->rise == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 1; k < axis->n; k++) {
        double width = k % 2 == 0 ? random_between(&r, block_side[0], block_side[1])
                                  : random_between(&r, street[0], street[1]);
        if (k % 6 == 1) width = avenue;
        axis->at[k] = axis->at[k - 1] + width;
    }
    const double half = axis->at[axis->n - 1] / 2;
    for (size_t k = 0; k < axis->n; k++) { /* sums over x and y, so that no cell of the plan is twisted */
        const double t = axis->at[k] / half - 1;
        if (strcmp(terrain, "valley") == 0) axis->rise[k] = valley_slope * half * t * t;
        if (strcmp(terrain, "hill") == 0) axis->rise[k] = hill_slope * half * (1 + cos(M_PI * t)) / 2;
    }
done:
    return status;
}

/* Quantiles of the variant's heights in random order, so that their sum does not depend on the seed. */
static void deal_heights(city_plan *plan, unsigned variant, uint64_t r) {
    for (size_t b = 0; b < plan->buildings.n; b++) {
        const double u = ((double)b + .5) / (double)plan->buildings.n;
        const size_t other = (size_t)(random_next(&r) % (b + 1));
        plan->heights[b] = plan->heights[other];
        plan->heights[other] = variants[variant - 1].low + variants[variant - 1].middle * u +
                               variants[variant - 1].top * pow(u, variants[variant - 1].power);
    }
}

/* The same seed gives the same streets and buildings whatever the variant and terrain, which must be known
 * ones. plan is filled and owned by the caller (city_plan_free), also after an error. */
static lam_status city_plan_make(const generate_options *options, size_t blocks_per_side, city_plan *plan,
                                 lam_error *error) {
    lam_status status = LAM_OK;
    *plan = (city_plan){0};
    const city_axis *x = &plan->axes[0], *y = &plan->axes[1];
    for (int a = 0; a < 2; a++)
        TRY(make_axis(&plan->axes[a], blocks_per_side, random_stream(options->seed, 1 + (uint64_t)a),
                      options->terrain, error));
    uint64_t r = random_stream(options->seed, 3);
    for (size_t j = 0; j + 1 < y->n; j++)
        for (size_t i = 0; i + 1 < x->n; i++) {
            const city_rectangle cell = {{x->at[i], y->at[j]}, {x->at[i + 1], y->at[j + 1]}};
            if (i % 2 == 1 && j % 2 == 1)
                TRY(divide_block(plan, &r, &cell, cell, error));
            else
                TRY(rectangle_add(&plan->streets, cell, error));
        }
    plan->heights = memory_allocate(plan->buildings.n, sizeof *plan->heights, "the plan of a city", error);
    if (plan->heights == NULL) TRY(LAM_ERR_MEMORY);
    deal_heights(plan, options->variant, random_stream(options->seed, 4));
done:
    return status;
}

static void city_plan_free(city_plan *plan) {
    for (int a = 0; a < 2; a++) {
        free(plan->axes[a].at);
        free(plan->axes[a].rise);
    }
    free(plan->streets.items);
    free(plan->yards.items);
    free(plan->buildings.items);
    free(plan->heights);
    *plan = (city_plan){0};
}

static double rise_at(const city_axis *axis, double x) {
    size_t k = 1;
    while (k + 1 < axis->n && x > axis->at[k]) k++;
    if (x == axis->at[k]) return axis->rise[k]; /* the same bits from both sides */
    const double share = (x - axis->at[k - 1]) / (axis->at[k] - axis->at[k - 1]);
    return axis->rise[k - 1] + (axis->rise[k] - axis->rise[k - 1]) * share;
}

/* Height of the ground: a function of x plus one of y, each straight across a block or street, so that every
 * rectangle of the plan lies in a plane and no neighbours gape, however they are meshed. */
static double city_ground(const city_plan *plan, double x, double y) {
    return rise_at(&plan->axes[0], x) + rise_at(&plan->axes[1], y);
}

/* The size of the whole city, and the least number of elements of a block, below which cells would be longer
 * than houses: a city of fewer elements has fewer blocks. As in Aguerre 2016, finer cities divide each cell
 * of the coarsest into four, once or more often. */
enum { BLOCKS_PER_SIDE = 7, LEAST_PER_BLOCK = 160, THESIS_ELEMENTS = 35588 };

/* The division into cells of about size^2 (metres), each cut into parts x parts. */
typedef struct cell_rule {
    double size;
    size_t parts;
} cell_rule;

static const scene_draft_material grey = {"grey", {.7, .7, .7}, {0, 0, 0}};

/* Cells of about size^2: the shorter side is rounded first and the other makes up for it, up to cells twice
 * as long as wide. */
static lam_status add_cells(scene_draft *d, const double quad[4][3], const cell_rule *cells,
                            lam_error *error) {
    const double size = cells->size;
    const double along = (point_distance(quad[0], quad[1]) + point_distance(quad[3], quad[2])) / 2;
    const double across = (point_distance(quad[0], quad[3]) + point_distance(quad[1], quad[2])) / 2;
    const double shorter = fmin(along, across), longer = fmax(along, across);
    const size_t n_shorter = scene_draft_steps_along(d, shorter, size);
    const double width = shorter / (double)n_shorter;
    const size_t n_longer = scene_draft_steps_along(d, longer, fmin(size * size / width, 2 * width));
    const size_t na = cells->parts * (along < across ? n_shorter : n_longer),
                 nb = cells->parts * (along < across ? n_longer : n_shorter);
    if (!d->counting) return scene_draft_grid(d, quad, na, nb, error);
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

static lam_status add_ground(scene_draft *d, const city_plan *plan, const city_rectangles *all,
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

static lam_status add_buildings(scene_draft *d, const city_plan *plan, bool roofs, const cell_rule *cells,
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

/* True where a whole city of cells cut into parts x parts has enough elements. */
static bool coarsest_fits(size_t wanted, size_t parts) {
    return wanted / (parts * parts) >= (size_t)BLOCKS_PER_SIDE * BLOCKS_PER_SIDE * LEAST_PER_BLOCK;
}

static lam_status city_cells(scene_draft *d, const generate_options *options, double size, lam_error *error) {
    lam_status status = LAM_OK;
    city_plan plan = {0};
    size_t blocks = BLOCKS_PER_SIDE;
    cell_rule cells = {.size = size, .parts = 1};
    while (blocks > 1 && blocks * blocks * LEAST_PER_BLOCK > wanted_elements(options)) blocks--;
    while (coarsest_fits(wanted_elements(options), 2 * cells.parts)) cells.parts *= 2;
    TRY(city_plan_make(options, blocks, &plan, error));
    TRY(scene_draft_group(d, "street", &grey, error));
    TRY(add_ground(d, &plan, &plan.streets, &cells, error));
    TRY(scene_draft_group(d, "yard", &grey, error));
    TRY(add_ground(d, &plan, &plan.yards, &cells, error));
    TRY(scene_draft_group(d, "facade", &grey, error));
    TRY(add_buildings(d, &plan, false, &cells, error));
    TRY(scene_draft_group(d, "roof", &grey, error));
    TRY(add_buildings(d, &plan, true, &cells, error));
done:
    city_plan_free(&plan);
    return status;
}

lam_status generate_city(scene_draft *d, const generate_options *options, lam_error *error) {
    lam_status status = LAM_OK;
    const char *terrain = options->terrain == NULL ? "(none)" : options->terrain;
    if (options->variant < 1 || options->variant > 3)
        FAIL(error, LAM_ERR_ARGUMENT, "city: variant = %u, must be 1, 2 or 3", options->variant);
    if (strcmp(terrain, "flat") != 0 && strcmp(terrain, "valley") != 0 && strcmp(terrain, "hill") != 0)
        FAIL(error, LAM_ERR_ARGUMENT, "city: terrain = '%s', must be flat, valley or hill", terrain);
    TRY(scene_draft_build_near(d, city_cells, options, wanted_elements(options), error));
done:
    return status;
}
