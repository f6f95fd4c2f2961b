#include "solver/scene/facet/place_grid.h"

#include <math.h>
#include <stdlib.h>

/* Cells along an axis at most: two million in all. */
enum { CELLS_MOST = 128 };

static size_t cell_of(const place_grid *g, int axis, double x) {
    const double at = floor((x - g->low[axis]) / g->cell);
    if (!(at > 0)) return 0;
    return at < (double)(g->count[axis] - 1) ? (size_t)at : g->count[axis] - 1;
}

static size_t cell_at(const place_grid *g, const double point[3]) {
    return (cell_of(g, 2, point[2]) * g->count[1] + cell_of(g, 1, point[1])) * g->count[0] +
           cell_of(g, 0, point[0]);
}

lam_status place_grid_create(size_t n, const double (*points)[3], const uint32_t *keep, place_grid *out,
                             lam_error *error) {
    lam_status status = LAM_OK;
    place_grid g = {.low = {INFINITY, INFINITY, INFINITY}};
    double high[3] = {-INFINITY, -INFINITY, -INFINITY}, widest = 0;
    size_t kept = 0;
    for (size_t v = 0; v < n; v++) {
        kept += keep[v] == v;
        for (int d = 0; d < 3; d++) {
            g.low[d] = fmin(g.low[d], points[v][d]);
            high[d] = fmax(high[d], points[v][d]);
        }
    }
    for (int d = 0; d < 3 && kept > 0; d++) widest = fmax(widest, high[d] - g.low[d]);
    const double along = fmin(ceil(.5 * sqrt((double)kept)) + 1, CELLS_MOST);
    g.cell = widest > 0 ? widest / along : 1;
    for (int d = 0; d < 3; d++)
        g.count[d] = kept > 0 ? (size_t)fmin(floor((high[d] - g.low[d]) / g.cell) + 1, CELLS_MOST) : 1;
    const size_t cells = g.count[0] * g.count[1] * g.count[2];
    g.first = memory_allocate(cells + 2, sizeof *g.first, "edges of faces", error);
    g.items = memory_allocate(kept + 1, sizeof *g.items, "edges of faces", error);
    if (g.first == NULL || g.items == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t v = 0; v < n; v++)
        if (keep[v] == v) g.first[cell_at(&g, points[v]) + 2]++;
    for (size_t c = 0; c < cells; c++) g.first[c + 2] += g.first[c + 1];
    for (size_t v = 0; v < n; v++)
        if (keep[v] == v) g.items[g.first[cell_at(&g, points[v]) + 1]++] = (uint32_t)v;
    *out = g;
    g = (place_grid){.cell = 0};
done:
    place_grid_free(&g);
    return status;
}

void place_grid_free(place_grid *g) {
    free(g->first);
    free(g->items);
    *g = (place_grid){.cell = 0};
}

lam_status place_grid_along(const place_grid *g, const double p[3], const double q[3], double slack,
                            place_visit *visit, void *context, lam_error *error) {
    lam_status status = LAM_OK;
    int axis = 0;
    for (int d = 1; d < 3; d++)
        if (fabs(q[d] - p[d]) > fabs(q[axis] - p[axis])) axis = d;
    const double length = q[axis] - p[axis];
    const size_t last = cell_of(g, axis, fmax(p[axis], q[axis]) + slack);
    /* Layer by layer across the axis that the segment is most along; in each it passes few cells. */
    for (size_t layer = cell_of(g, axis, fmin(p[axis], q[axis]) - slack); layer <= last; layer++) {
        double t[2] = {0, 1};
        size_t from[3], to[3];
        /* The outermost layers hold all that lies beyond. */
        const double level[2] = {
            layer == 0 ? -INFINITY : g->low[axis] + (double)layer * g->cell - slack,
            layer == g->count[axis] - 1 ? INFINITY : g->low[axis] + (double)(layer + 1) * g->cell + slack};
        for (int k = 0; k < 2 && length != 0; k++) t[k] = (level[k] - p[axis]) / length;
        for (int d = 0; d < 3; d++) {
            const double a = p[d] + fmin(fmax(t[0], 0), 1) * (q[d] - p[d]),
                         b = p[d] + fmin(fmax(t[1], 0), 1) * (q[d] - p[d]);
            from[d] = cell_of(g, d, fmin(a, b) - slack);
            to[d] = cell_of(g, d, fmax(a, b) + slack);
        }
        from[axis] = to[axis] = layer;
        for (size_t z = from[2]; z <= to[2]; z++)
            for (size_t y = from[1]; y <= to[1]; y++)
                for (size_t x = from[0]; x <= to[0]; x++) {
                    const size_t cell = (z * g->count[1] + y) * g->count[0] + x;
                    for (size_t k = g->first[cell]; k < g->first[cell + 1]; k++)
                        TRY(visit(context, g->items[k], error));
                }
    }
done:
    return status;
}
