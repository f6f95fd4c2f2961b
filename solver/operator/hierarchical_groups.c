/* Groups of neighbouring coefficients of K, which share tiles, and the steps that they are rounded to. */
#include "solver/operator/hierarchical.h"

#include <math.h>
#include <stdlib.h>

/* The step over the threshold, of coefficients of weight 1: the rounding error of a number is a seventh of
 * the threshold then, and that of an answer a tenth of what the numbers below the threshold would have added.
 */
static const double step_share = .5;
/* The step of the root's scaling functions over that: most of uniform emission is theirs, which K answers
 * exactly before it is rounded. They are one to four rows, for a digit more of each number. */
static const float root_share = 1.f / 256;

lam_status hierarchical_steps(const wavelets *basis, double threshold, float **out, lam_error *error) {
    lam_status status = LAM_OK;
    float *weight = NULL, *made = memory_allocate(basis->n, sizeof *made, "operator", error);
    if (made == NULL) TRY(LAM_ERR_MEMORY);
    TRY(wavelets_weights(basis, &weight, error));
    for (size_t t = 0; t < basis->n_nodes; t++) {
        const wavelet_node *a = &basis->nodes[t];
        const size_t end = t + 1 < basis->n_nodes ? a->first + a->inputs - a->scaling : basis->n;
        for (size_t i = a->first; i < end; i++) made[i] = (float)sqrt(step_share * threshold) * weight[t];
    }
    for (size_t i = basis->n - basis->nodes[basis->n_nodes - 1].scaling; i < basis->n; i++)
        made[i] *= root_share;
    *out = made;
    made = NULL;
done:
    free(weight);
    free(made);
    return status;
}

lam_status hierarchical_groups(const wavelet_plan *plan, const float *step, float least, size_t *n_groups,
                               tile_group **groups, float **group_step, lam_error *error) {
    lam_status status = LAM_OK;
    size_t end = 0, count = 0; /* coefficients of the plan, groups so far */
    tile_group *made = memory_allocate(plan->n_used, sizeof *made, "operator", error);
    float *smallest = memory_allocate(plan->n_used, sizeof *smallest, "operator", error);
    if (made == NULL || smallest == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t t = 0; t <= plan->n_steps; t++) {
        size_t left = t < plan->n_steps ? plan->steps[t].own : plan->n_used - end;
        for (uint32_t size; left > 0; left -= size, end += size) {
            const uint32_t first = plan->coefficient[end];
            size = left < TILE ? (uint32_t)left : TILE;
            if (count == 0 || made[count - 1].size + size > TILE ||
                made[count - 1].first + made[count - 1].size != first) {
                made[count] = (tile_group){.first = first};
                smallest[count++] = INFINITY;
            }
            made[count - 1].size += size;
            for (uint32_t i = first; i < first + size; i++)
                smallest[count - 1] = fmaxf(fminf(smallest[count - 1], step[i]), least);
        }
    }
    *n_groups = count;
    *groups = made;
    *group_step = smallest;
    made = NULL;
    smallest = NULL;
done:
    free(made);
    free(smallest);
    return status;
}
