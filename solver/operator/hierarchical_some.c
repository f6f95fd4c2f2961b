#include "solver/operator/hierarchical_some.h"

#include "solver/base/work_area.h"
#include "solver/operator/wavelet/wavelet_paths.h"

#include <string.h>

/* Where more than one in so many elements is lit, all are transformed; numbers that are compared with 0 at
 * once. */
enum { LIT_SHARE = 4, LOOKED_AT = 64 };

bool hierarchical_some_add(const hierarchical *self, size_t *total) {
    const wavelet_plan *plan = &self->plan;
    const size_t steps = plan->n_steps * sizeof(uint32_t), groups = self->n_groups * sizeof(uint32_t),
                 parts[] = {steps,
                            groups,
                            steps,
                            groups,
                            plan->n_used + TILED_PAST,
                            wavelet_marks_words(plan) * sizeof(uint64_t),
                            wavelet_marks_words(plan) * sizeof(uint64_t),
                            plan->n_steps};
    for (size_t k = 0; k < sizeof parts / sizeof *parts; k++)
        if (!work_area_add(total, parts[k])) return false;
    return true;
}

static hierarchical_part take_part(const hierarchical *self, void **work) {
    hierarchical_part part = {.n_steps = 0};
    part.steps = work_area_take(work, self->plan.n_steps * sizeof *part.steps);
    part.groups = work_area_take(work, self->n_groups * sizeof *part.groups);
    return part;
}

hierarchical_some hierarchical_some_take(const hierarchical *self, void **work) {
    const wavelet_plan *plan = &self->plan;
    hierarchical_some some = {.self = self};
    some.asked = take_part(self, work);
    some.lit = take_part(self, work);
    some.wanted = work_area_take(work, plan->n_used + TILED_PAST);
    some.marks = work_area_take(work, wavelet_marks_words(plan) * sizeof *some.marks);
    some.lit_at = work_area_take(work, wavelet_marks_words(plan) * sizeof *some.lit_at);
    some.flags = work_area_take(work, plan->n_steps);
    memset(some.flags, 0, plan->n_steps);
    return some;
}

static void clear_marks(hierarchical_some *some) {
    memset(some->marks, 0, wavelet_marks_words(&some->self->plan) * sizeof *some->marks);
}

/* Fills a part from the marks. The scaling coefficients of the root follow after those of all steps. */
static void find_part(hierarchical_some *some, hierarchical_part *part) {
    const wavelet_plan *plan = &some->self->plan;
    const uint32_t *group_ends = some->self->K[0].first + 1; /* coefficients ascend, and so do their groups */
    size_t count = 0;
    uint32_t group = 0;
    part->n_steps = wavelet_plan_paths(plan, some->marks, some->flags, part->steps);
    for (size_t k = 0; k < part->n_steps; k++) {
        const plan_step *a = &plan->steps[part->steps[k]];
        const bool root = k + 1 == part->n_steps;
        const uint32_t first = a->first, last = first + a->own + (root ? a->scaling : 0);
        for (uint32_t i = first; i < last; i++) {
            while (group_ends[group] <= i) group++;
            if (count == 0 || part->groups[count - 1] != group) part->groups[count++] = group;
        }
    }
    part->n_groups = count;
}

bool hierarchical_some_ask(hierarchical_some *some, size_t n_selected, const uint32_t *selected,
                           size_t share) {
    const hierarchical *self = some->self;
    const wavelet_plan *plan = &self->plan;
    if (n_selected > self->base.n / share) return false;
    clear_marks(some);
    for (size_t r = 0; r < n_selected; r++)
        wavelet_mark(some->marks, operator_position(&self->base, selected[r]));
    find_part(some, &some->asked);
    if (some->asked.n_steps > plan->n_steps / share) return false;
    memset(some->wanted, 0, plan->n_used + TILED_PAST);
    for (size_t k = 0; k < some->asked.n_groups; k++)
        some->wanted[self->K[0].first[some->asked.groups[k]]] = 1;
    return true;
}

/* Marks the elements first ... last - 1 that are lit; returns their number. */
static size_t mark_light(const hierarchical_some *some, const float *E, const float *H0, size_t first,
                         size_t last) {
    size_t found = 0;
    for (size_t i = first; i < last; i++) {
        if (!(E[i] != 0 || (H0 != NULL && H0[i] != 0))) continue;
        wavelet_mark(some->marks, operator_position(&some->self->base, i));
        found++;
    }
    return found;
}

/* Finds the part of the light, unless it is the one that is known. */
static hierarchical_extent find_light(hierarchical_some *some, const float *E, const float *H0) {
    const size_t n = some->self->base.n, most = n / LIT_SHARE,
                 bytes = wavelet_marks_words(&some->self->plan) * sizeof *some->marks;
    size_t found = 0;
    clear_marks(some);
    for (size_t first = 0; first < n && found <= most; first += LOOKED_AT) {
        const size_t last = first + LOOKED_AT < n ? first + LOOKED_AT : n;
        if (!wavelet_is_dark(E + first, last - first) ||
            (H0 != NULL && !wavelet_is_dark(H0 + first, last - first)))
            found += mark_light(some, E, H0, first, last);
    }
    if (found > most) return LIT_MANY;
    if (found == 0) return LIT_NOWHERE;
    if (some->knows_lit && memcmp(some->marks, some->lit_at, bytes) == 0) return LIT_FEW;
    find_part(some, &some->lit);
    memcpy(some->lit_at, some->marks, bytes);
    some->knows_lit = true;
    return LIT_FEW;
}

bool hierarchical_some_light(hierarchical_some *some, const float *E, const float *H0) {
    if (H0 == NULL && some->E != NULL && memcmp(some->E, E, some->self->base.n * sizeof *E) == 0) return true;
    some->extent = find_light(some, E, H0);
    some->E = H0 == NULL ? E : NULL;
    return false;
}

void hierarchical_some_forward(hierarchical_some *some, size_t c, const float *E, const float *H0, float *X,
                               float *C, float *work) {
    const hierarchical *self = some->self;
    const wavelet_plan *plan = &self->plan;
    const float *rho = self->base.reflectance + c * self->base.n, *root = self->root_area;
    const uint32_t *order = self->base.order;
    const bool corrected = self->even.missing != NULL;
    double sum = 0, parts[MEAN_PARTS] = {0};
    size_t piece = 0;
    for (size_t k = 0; k < some->lit.n_steps; k++) {
        const plan_step *a = &plan->steps[some->lit.steps[k]];
        if (a->from_left > 0) continue;
        const size_t first = a->begin, last = first + a->count;
        for (size_t p = first; p < last; p++)
            X[p] = root[p] * operator_light(rho, E, H0, order != NULL ? order[p] : p);
        if (!corrected) continue;
        /* As a sum over each piece, to which what is dark adds nothing. */
        for (; first >= wavelet_piece_end(plan, &plan->pieces[piece]); piece++) {
            sum += mean_correction_total(parts);
            memset(parts, 0, sizeof parts);
        }
        const size_t from = first - wavelet_piece_begin(plan, &plan->pieces[piece]);
        for (size_t p = first; p < last; p++)
            parts[(from + p - first) % MEAN_PARTS] += (double)root[p] * (double)X[p];
    }
    wavelet_plan_forward_some(plan, some->lit.n_steps, some->lit.steps, X, self->K[self->of_channel[c]].step,
                              C, work);
    some->sum = sum + mean_correction_total(parts);
}

void hierarchical_some_multiply(const hierarchical_some *some, size_t c, const float *C, float *to) {
    const tiled_rows *K = &some->self->K[some->self->of_channel[c]];
    const hierarchical_part *lit = &some->lit, *asked = &some->asked;
    const bool few = some->extent == LIT_FEW;
    if (few && tiled_few_columns_of(K, lit->n_groups, lit->groups, C))
        tiled_multiply_columns_of(K, lit->n_groups, lit->groups, asked->n_groups, asked->groups, some->wanted,
                                  C, to);
    else if (!few && tiled_few_columns(K, C))
        tiled_multiply_columns(K, C, to);
    else
        tiled_multiply_rows(K, asked->n_groups, asked->groups, C, to);
}
