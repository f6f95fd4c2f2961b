#include "solver/direct/luminaire_runs.h"

#include <stdlib.h>
#include <string.h>

/* A luminaire in the order of what it ignores. */
typedef struct ordered_run {
    size_t row;
    ignored_groups ignored;
} ordered_run;

static int compare_ignored(const ignored_groups *a, const ignored_groups *b) {
    if (a->n != b->n) return a->n < b->n ? -1 : 1;
    for (size_t k = 0; k < a->n; k++)
        if (a->groups[k] != b->groups[k]) return a->groups[k] < b->groups[k] ? -1 : 1;
    return 0;
}

static int by_ignored(const void *left, const void *right) {
    const ordered_run *a = left, *b = right;
    const int groups = compare_ignored(&a->ignored, &b->ignored);
    return groups != 0 ? groups : (a->row > b->row) - (a->row < b->row);
}

lam_status luminaire_runs(const mesh *m, const placed_luminaires *p, size_t n_wanted, const size_t *wanted,
                          luminaire_runner *runner, void *context, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = wanted != NULL ? n_wanted : p->n;
    double(*boxes)[2][3] = NULL;
    luminaire_sight sight = {.m = NULL};
    ordered_run *order = memory_allocate(n, sizeof *order, "luminaires", error);
    if (order == NULL) return LAM_ERR_MEMORY;
    TRY(group_boxes_make(m, &boxes, error));
    for (size_t row = 0; row < n; row++) {
        const placed_luminaire *l = &p->luminaires[wanted != NULL ? wanted[row] : row];
        order[row].row = row;
        TRY(ignored_groups_find(m, (const double(*)[2][3])boxes, p, l, &order[row].ignored, error));
    }
    if (n > 0) qsort(order, n, sizeof *order, by_ignored);
    for (size_t k = 0; k < n; k++) {
        const ignored_groups *ignored = &order[k].ignored;
        luminaire_run run = {.step = k, .row = order[k].row, .sight = &sight, .ignored = ignored};
        if (k == 0 || compare_ignored(&order[k - 1].ignored, ignored) != 0) {
            luminaire_sight_free(&sight);
            TRY(luminaire_sight_make(m, ignored, &sight, error));
        }
        run.luminaire = wanted != NULL ? wanted[run.row] : run.row;
        placed_source_set(p, &p->luminaires[run.luminaire], m->up, &run.source);
        luminaire_sight_settle(&sight, &run.source, run.moved);
        TRY(runner(context, &run, error));
    }
done:
    luminaire_sight_free(&sight);
    for (size_t row = 0; row < n; row++) free(order[row].ignored.groups);
    free(order);
    free(boxes);
    return status;
}
