#include "solver/formfactor/pairs/pairs_refine.h"

#include <math.h>
#include <stdlib.h>

static pair_state state_of(const pairs_run *run, uint32_t i, uint32_t j) {
    return pair_rows_state(&run->rows, run->on.tree.position[i], run->on.tree.position[j]);
}

/* True where a neighbouring pair, with either element replaced by one that shares an edge with it, is mixed
 * or has the opposite state: a shadow edge may cross this pair. */
static bool at_a_border(const pairs_run *run, uint32_t i, uint32_t j, pair_state state) {
    for (int side = 0; side < 2; side++) {
        const uint32_t kept = side == 0 ? i : j;
        const uint32_t *others = run->neighbours[side == 0 ? j : i];
        for (int k = 0; k < NEIGHBOURS_MOST && others[k] != UINT32_MAX; k++) {
            if (others[k] == kept) continue;
            const pair_state other = state_of(run, kept, others[k]);
            if (other == PAIR_MIXED ||
                (state == PAIR_OPEN ? other == PAIR_HIDDEN : other == PAIR_OPEN || other == PAIR_CERTAIN))
                return true;
        }
    }
    return false;
}

/* True where a pair gets occlusion_estimate. */
static bool is_mixed(const pairs_run *run, uint32_t i, uint32_t j, uint8_t state) {
    if (state == PAIR_CERTAIN || (state & (PAIR_SETTLED | PAIR_EXACT)) != 0) return false;
    return state == PAIR_MIXED || at_a_border(run, i, j, (pair_state)state);
}

/* The number of segments that pairs take at the accuracy asked for: mixed ones, and those that projection has
 * saved. */
typedef struct segment_count {
    double mixed, saved;
} segment_count;

static segment_count segments_of_block(const pairs_run *run, size_t index) {
    const pair_block *block = &run->rows.blocks[index];
    segment_count sum = {0, 0};
    size_t r = 0;
    for (size_t at = 0; at < block->used; at++) {
        while (at >= block->begin[r + 1]) r++;
        const uint32_t i = run->on.tree.element[pair_rows_first(index) + r],
                       j = run->on.tree.element[block->other[at]];
        if (is_mixed(run, i, j, block->state[at]))
            sum.mixed += occlusion_segments(&run->on.occlusion, i, j, (double)block->exchange[at]);
        else if (block->state[at] == (PAIR_MIXED | PAIR_EXACT))
            sum.saved += occlusion_segments(&run->on.occlusion, i, j, (double)block->exchange[at]);
    }
    return sum;
}

/* Where most pairs are projected the others have most of the error, and are so few that elements which see
 * little may demand segments of them. Elsewhere this takes more time than it saves: in a patio a sixth more.
 * Near pairs need none, as the rays beside them err more. */
static lam_status demand_segments(pairs_run *run, lam_error *error) {
    static const double an_element = 512;
    if (!run->on.projects || run->on.options->threshold > 0) return LAM_OK;
    return pair_demand_find(&run->rows, run->on.tree.element, run->on.m->area,
                            an_element * (double)run->on.m->n, &run->demand, error);
}

lam_status pairs_share_segments(pairs_run *run, lam_error *error) {
    const size_t n_blocks = run->rows.n_blocks;
    segment_count all = {0, 0};
    segment_count *of_block = memory_allocate(n_blocks, sizeof *of_block, "pairs", error);
    if (of_block == NULL) return LAM_ERR_MEMORY;
#pragma omp parallel for schedule(dynamic, 4)
    for (size_t b = 0; b < n_blocks; b++) of_block[b] = segments_of_block(run, b);
    for (size_t b = 0; b < n_blocks; b++) {
        all.mixed += of_block[b].mixed;
        all.saved += of_block[b].saved;
    }
    free(of_block);
    if (!(all.mixed > 0)) return demand_segments(run, error);
    const double least = run->on.options->segments_least * all.mixed / (all.mixed + all.saved);
    const double cast = fmin(fmax(all.mixed, least), run->on.options->segments_most);
    run->on.occlusion.accuracy *= pow(all.mixed / cast, SEGMENTS_POWER);
    return demand_segments(run, error);
}

/* Sets *g to the visible part of a pair, by at least `demand` segments. They are tested against a list of the
 * pair's occluders where there are enough of them. */
static bool refine_pair(const pairs_run *run, uint32_t position, uint32_t other, double demand,
                        leaf_reaches *to, float *g) {
    const uint32_t i = run->on.tree.element[position], j = run->on.tree.element[other],
                   leaf = run->leaf[position];
    pair_occluders between;
    segment_list list, *among = NULL;
    if (run->listed != NULL &&
        fmax(occlusion_segments(&run->on.occlusion, i, j, (double)*g), demand) >= SEGMENTS_LISTED) {
        if ((to->n == 0 || to->leaf != leaf) &&
            !leaf_reaches_find(&run->on.tree, &run->on.links, run->parent, leaf, to))
            return false;
        const link_occluders *of_link = leaf_reaches_among(
            &run->on.tree, &run->on.few.occluders, LINK_OCCLUDERS_MOST, to, leaf_reaches_at(to, other));
        if (of_link == NULL) return false;
        const few_verdict found = few_occluders_between(&run->on.few, of_link, i, j, &between);
        if (found == FEW_OPEN) return true;
        if (found == FEW_HIDDEN) {
            *g = 0;
            return true;
        }
        if (between.count != OCCLUDERS_UNCOUNTED) {
            list = (segment_list){between.count, between.of};
            among = &list;
        }
    }
    *g = (float)occlusion_estimate_by(&run->on.occlusion, among, i, j, (double)*g, demand);
    return true;
}

/* Refines a pair whose test sufficed, or found nothing, where the light of one of its elements demands it.
 */
static bool refine_demanded(const pairs_run *run, uint32_t position, uint32_t other, uint8_t state,
                            leaf_reaches *to, float *g) {
    const uint32_t i = run->on.tree.element[position], j = run->on.tree.element[other];
    const bool hidden = (state & ~PAIR_SETTLED) == PAIR_HIDDEN;
    /* Of another pair g is what was seen, about half of what there is. */
    const bool demanded = pair_demand_of(&run->demand, i, j, hidden ? (double)*g : 2 * (double)*g) > 0;
    if (!demanded || state == (PAIR_OPEN | PAIR_SETTLED)) {
        if (hidden) *g = 0;
        return true;
    }
    if (!hidden)
        *g = (float)pair_factor_exchange(&run->on.rules, &run->on.polygons[i], &run->on.polygons[j],
                                         run->on.options->tolerance);
    return refine_pair(run, position, other, pair_demand_of(&run->demand, i, j, (double)*g), to, g);
}

bool pairs_refine_block(pairs_run *run, size_t index, bool known, leaf_reaches *to, pairs_report *sum) {
    pair_block *block = &run->rows.blocks[index];
    size_t r = 0;
    for (size_t at = 0; at < block->used; at++) {
        while (at >= block->begin[r + 1]) r++;
        const pair_state state = (pair_state)(block->state[at] & ~(PAIR_SETTLED | PAIR_EXACT));
        const uint32_t i = run->on.tree.element[pair_rows_first(index) + r],
                       j = run->on.tree.element[block->other[at]];
        sum->facing++;
        if (state == PAIR_CERTAIN) {
            sum->certain++;
        } else if (block->state[at] & PAIR_SETTLED) {
            sum->settled++;
            if (!known && !refine_demanded(run, (uint32_t)(pair_rows_first(index) + r), block->other[at],
                                           block->state[at], to, &block->exchange[at]))
                return false;
        } else if (block->state[at] & PAIR_EXACT) {
            sum->projected += state == PAIR_MIXED;
            sum->hidden += state == PAIR_HIDDEN;
        } else if (is_mixed(run, i, j, block->state[at])) {
            sum->mixed++;
            if (!known && !refine_pair(run, (uint32_t)(pair_rows_first(index) + r), block->other[at], 0, to,
                                       &block->exchange[at]))
                return false;
        } else if (state == PAIR_OPEN) {
            sum->open++;
        } else {
            sum->hidden++;
            if (!known && !refine_demanded(run, (uint32_t)(pair_rows_first(index) + r), block->other[at],
                                           block->state[at], to, &block->exchange[at]))
                return false;
        }
    }
    return true;
}
