#include "solver/scene/facet/polygon_slabs.h"

#include "solver/base/array_grow.h"

#include <math.h>
#include <stdlib.h>

/* An edge within a slab: where it enters and leaves it. */
typedef struct crossing {
    double low, high;
} crossing;

static int ascending(const void *a, const void *b) {
    const double p = *(const double *)a, q = *(const double *)b;
    return (p > q) - (p < q);
}

static int by_middle(const void *a, const void *b) {
    const crossing *p = a, *q = b;
    const double left = p->low + p->high, right = q->low + q->high;
    return (left > right) - (left < right);
}

static double at_level(const slab_edge *e, double y) {
    const double t = (y - e->from[1]) / (e->to[1] - e->from[1]);
    return e->from[0] + t * (e->to[0] - e->from[0]);
}

typedef struct slab_list {
    slab_piece *pieces;
    size_t n, capacity;
} slab_list;

static lam_status add(slab_list *list, slab_piece piece, lam_error *error) {
    if (array_grow(&list->pieces, &list->capacity, list->n + 1, sizeof *list->pieces, "outlines", error) !=
        LAM_OK)
        return LAM_ERR_MEMORY;
    list->pieces[list->n++] = piece;
    return LAM_OK;
}

/* The trapezoid between two crossings from y to y + height: a parallelogram, or two triangles. */
static lam_status add_between(slab_list *list, const crossing *left, const crossing *right, double y,
                              double height, double slack, lam_error *error) {
    lam_status status = LAM_OK;
    const double bottom = right->low - left->low, top = right->high - left->high;
    const double lean = left->high - left->low;
    if (fmax(bottom, top) <= slack) return LAM_OK;
    if (fabs(bottom - top) <= slack)
        return add(list, (slab_piece){{left->low, y}, {{bottom, 0}, {lean, height}}, false}, error);
    if (bottom > slack)
        TRY(add(list, (slab_piece){{left->low, y}, {{bottom, 0}, {right->high - left->low, height}}, true},
                error));
    if (top > slack)
        TRY(add(list, (slab_piece){{left->high, y + height}, {{-lean, -height}, {top, 0}}, true}, error));
done:
    return status;
}

lam_status polygon_slabs(size_t n_edges, const slab_edge *edges, double slack, slab_piece **pieces, size_t *n,
                         lam_error *error) {
    lam_status status = LAM_OK;
    slab_list list = {.n = 0};
    double *levels = memory_allocate(2 * n_edges + 1, sizeof *levels, "outlines", error);
    crossing *row = memory_allocate(n_edges + 1, sizeof *row, "outlines", error);
    size_t n_levels = 0;
    if (levels == NULL || row == NULL) TRY(LAM_ERR_MEMORY);
    TRY(array_grow(&list.pieces, &list.capacity, 1, sizeof *list.pieces, "outlines", error));
    for (size_t e = 0; e < n_edges; e++) {
        levels[n_levels++] = edges[e].from[1];
        levels[n_levels++] = edges[e].to[1];
    }
    qsort(levels, n_levels, sizeof *levels, ascending);
    for (size_t k = 0, next; k < n_levels; k = next) {
        for (next = k + 1; next < n_levels && levels[next] - levels[k] <= slack;) next++;
        if (next == n_levels) break;
        const double low = levels[k], high = levels[next], middle = .5 * (low + high);
        size_t count = 0;
        for (size_t e = 0; e < n_edges; e++)
            if ((edges[e].from[1] < middle) != (edges[e].to[1] < middle)) {
                row[count].low = at_level(&edges[e], low);
                row[count++].high = at_level(&edges[e], high);
            }
        qsort(row, count, sizeof *row, by_middle);
        for (size_t c = 0; c + 1 < count; c += 2)
            TRY(add_between(&list, &row[c], &row[c + 1], low, high - low, slack, error));
    }
    *pieces = list.pieces;
    *n = list.n;
    list.pieces = NULL;
done:
    free(levels);
    free(row);
    free(list.pieces);
    return status;
}
