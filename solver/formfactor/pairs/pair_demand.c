#include "solver/formfactor/pairs/pair_demand.h"

#include "solver/formfactor/sight/occlusion.h"

#include <math.h>
#include <stdlib.h>

/* Candidates by log2 of g / L, in steps of a half. */
enum { STEPS = 128, STEP_OF_ONE = 96 };

static const double finest = 1e-5; /* level */

/* The unoccluded exchange area of a pair that may demand segments, or about so much; 0 of others. Of a test
 * that sufficed, only what it saw is known. */
static double unoccluded(uint8_t state, float exchange) {
    if (state == (PAIR_MIXED | PAIR_SETTLED)) return 2 * (double)exchange;
    return (state & PAIR_EXACT) == 0 && (state & ~PAIR_SETTLED) == PAIR_HIDDEN ? (double)exchange : 0;
}

/* The part of a pair that its test saw. */
static double seen_part(uint8_t state, float exchange) {
    if (state == PAIR_MIXED) return .5 * (double)exchange;
    return (state & PAIR_EXACT) == 0 && (state & ~PAIR_SETTLED) == PAIR_HIDDEN ? 0 : (double)exchange;
}

/* The light of elements: one thread adds, so that sums have one order. */
static void find_light(const pair_rows *rows, const uint32_t *order, const double *area, double *light) {
    static const double hemisphere = 1e-3;
    for (size_t b = 0; b < rows->n_blocks; b++) {
        const pair_block *block = &rows->blocks[b];
        for (size_t r = 0; r < pair_rows_length(rows, b); r++) {
            double sum = 0;
            for (size_t at = block->begin[r]; at < block->begin[r + 1]; at++) {
                const double seen = seen_part(block->state[at], block->exchange[at]);
                light[order[block->other[at]]] += seen;
                sum += seen;
            }
            light[order[pair_rows_first(b) + r]] += sum;
        }
    }
    for (size_t i = 0; i < rows->n; i++) light[i] = fmax(light[i], hemisphere * area[i]);
}

/* True where N is that of an occlusion test at most. */
static bool is_tested(double g, double light, double level) {
    static const double error = SEGMENTS_ERROR * .2333; /* N^-SEGMENTS_POWER of a packet */
    return error * g <= level * light;
}

/* N of a pair with g / L = ratio. */
static double demand_of(double ratio, double level) {
    return fmin(pow(SEGMENTS_ERROR * ratio / level, 1 / SEGMENTS_POWER), DEMAND_MOST);
}

static void count_candidates(const pair_rows *rows, const uint32_t *order, const double *light,
                             double counts[STEPS]) {
    for (size_t b = 0; b < rows->n_blocks; b++) {
        const pair_block *block = &rows->blocks[b];
        for (size_t r = 0; r < pair_rows_length(rows, b); r++) {
            const uint32_t i = order[pair_rows_first(b) + r];
            for (size_t at = block->begin[r]; at < block->begin[r + 1]; at++) {
                const uint32_t j = order[block->other[at]];
                const double g = unoccluded(block->state[at], block->exchange[at]);
                const double lesser = fmin(light[i], light[j]);
                if (is_tested(g, lesser, finest)) continue;
                const double step = STEP_OF_ONE + floor(2 * log2(g / lesser));
                counts[step < 0 ? 0 : step < STEPS ? (size_t)step : STEPS - 1]++;
            }
        }
    }
}

/* About how many segments a level takes. To find a pair again costs as much as some of them, and as many more
 * where a list of its occluders is made. */
static double segments_at(const double counts[STEPS], double level) {
    static const double again = 128, list = 1024;
    double sum = 0;
    for (int k = 0; k < STEPS; k++) {
        const double N = demand_of(exp2(.5 * (k + .5 - STEP_OF_ONE)), level);
        if (N > VISIBILITY_PACKET) sum += counts[k] * (N + again + (N >= SEGMENTS_LISTED ? list : 0));
    }
    return sum;
}

lam_status pair_demand_find(const pair_rows *rows, const uint32_t *order, const double *area, double budget,
                            pair_demand *out, lam_error *error) {
    double counts[STEPS] = {0};
    pair_demand d = {.level = finest};
    d.light = memory_allocate(rows->n, sizeof *d.light, "pairs", error);
    if (d.light == NULL) return LAM_ERR_MEMORY;
    find_light(rows, order, area, d.light);
    count_candidates(rows, order, d.light, counts);
    while (segments_at(counts, d.level) > budget) d.level *= 1.1;
    *out = d;
    return LAM_OK;
}

void pair_demand_free(pair_demand *d) {
    free(d->light);
    *d = (pair_demand){.level = 0};
}

double pair_demand_of(const pair_demand *d, uint32_t i, uint32_t j, double g) {
    if (d->light == NULL) return 0;
    const double light = fmin(d->light[i], d->light[j]);
    return is_tested(g, light, d->level) ? 0 : demand_of(g / light, d->level);
}
