#include "solver/scene/generate/city_plan.h"
#include "solver/scene/generate/dice.h"
#include "solver/scene/tables.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Metres. What is seen from an element, in elements, hangs on how few blocks there are, how deep the streets
 * between them and how unlike the roofs beside each other. All of it, slopes included, is chosen so that F is
 * within 15 % as dense as in "Aguerre 2016, tables 4.1 and 4.5", counted as there; `lambert bench cities`
 * prints both. */
static const double avenue = 14, street[2] = {9, 13}, block_side[2] = {45, 65}, alley_width[2] = {3, 5};
static const double largest_lot = 22, empty_share = .05;

/* Rise of the ground over half a side of the site, and how it goes with x and with y, t from -1 to 1: a bowl;
 * a hill with a foot. */
static const double valley_slope = .12, hill_slope = .1;

/* Heights go like low + middle u + top u^power for u from 0 to 1: flat houses; low and middle-high ones; all
 * sizes, with a few skyscrapers. */
static const struct {
    double low, middle, top, power;
} variants[3] = {{5, 1.2, 0, 1}, {7, 6, 0, 1}, {21, 5, 36, 70}};

static lam_status rectangle_add(city_rectangles *all, city_rectangle one, lam_error *error) {
    city_rectangle *grown =
        array_grow(all->items, &all->capacity, all->n + 1, sizeof *grown, "the plan of a city", error);
    if (grown == NULL) return LAM_ERR_MEMORY;
    all->items = grown;
    all->items[all->n++] = one;
    return LAM_OK;
}

/* Cuts a part of a block by alleys until it is a lot. A lot that touches no street is a courtyard, and a few
 * others stay empty. */
static lam_status divide_block(city_plan *plan, dice *r, const city_rectangle *block, city_rectangle part,
                               lam_error *error) {
    lam_status status = LAM_OK;
    const double side[2] = {part.high[0] - part.low[0], part.high[1] - part.low[1]};
    const int axis = side[1] > side[0];
    if (side[axis] > largest_lot) {
        const double alley = dice_between(r, alley_width[0], alley_width[1]);
        const double cut = part.low[axis] + (side[axis] - alley) * dice_between(r, .38, .62);
        city_rectangle low = part, between = part, high = part;
        low.high[axis] = between.low[axis] = cut;
        between.high[axis] = high.low[axis] = cut + alley;
        TRY(rectangle_add(&plan->yards, between, error));
        TRY(divide_block(plan, r, block, low, error));
        TRY(divide_block(plan, r, block, high, error));
    } else {
        const bool court = part.low[0] > block->low[0] && part.high[0] < block->high[0] &&
                           part.low[1] > block->low[1] && part.high[1] < block->high[1];
        const bool empty = dice_between(r, 0, 1) < empty_share;
        TRY(rectangle_add(court || empty ? &plan->yards : &plan->buildings, part, error));
    }
done:
    return status;
}

static lam_status make_axis(city_axis *axis, size_t blocks, dice r, const char *terrain, lam_error *error) {
    lam_status status = LAM_OK;
    axis->n = 2 * blocks + 2;
    axis->at = memory_allocate(axis->n, sizeof *axis->at, "the plan of a city", error);
    axis->rise = memory_allocate(axis->n, sizeof *axis->rise, "the plan of a city", error);
    if (axis->at == NULL || axis->rise == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 1; k < axis->n; k++) {
        double width = k % 2 == 0 ? dice_between(&r, block_side[0], block_side[1])
                                  : dice_between(&r, street[0], street[1]);
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

/* Every height of the variant once, in random order: the sum does not hang on luck. */
static void deal_heights(city_plan *plan, unsigned variant, dice r) {
    for (size_t b = 0; b < plan->buildings.n; b++) {
        const double u = ((double)b + .5) / (double)plan->buildings.n;
        const size_t other = (size_t)(dice_throw(&r) % (b + 1));
        plan->heights[b] = plan->heights[other];
        plan->heights[other] = variants[variant - 1].low + variants[variant - 1].middle * u +
                               variants[variant - 1].top * pow(u, variants[variant - 1].power);
    }
}

lam_status city_plan_make(const generate_options *options, size_t blocks_per_side, city_plan *plan,
                          lam_error *error) {
    lam_status status = LAM_OK;
    *plan = (city_plan){0};
    const city_axis *x = &plan->axes[0], *y = &plan->axes[1];
    for (int a = 0; a < 2; a++)
        TRY(make_axis(&plan->axes[a], blocks_per_side, dice_for(options->seed, 1 + (uint64_t)a),
                      options->terrain, error));
    dice r = dice_for(options->seed, 3);
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
    deal_heights(plan, options->variant, dice_for(options->seed, 4));
done:
    return status;
}

void city_plan_free(city_plan *plan) {
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

double city_ground(const city_plan *plan, double x, double y) {
    return rise_at(&plan->axes[0], x) + rise_at(&plan->axes[1], y);
}
