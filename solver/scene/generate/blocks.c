#include "solver/scene/generate/blocks.h"

#include "solver/base/array_grow.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

double block_place(double x) {
    return round(x * 1000) / 1000;
}

lam_status block_add(blocks *all, int fill, double x0, double y0, double z0, double x1, double y1, double z1,
                     lam_error *error) {
    const block one = {{block_place(x0), block_place(y0), block_place(z0)},
                       {block_place(x1), block_place(y1), block_place(z1)},
                       fill};
    for (int axis = 0; axis < 3; axis++)
        if (!(one.low[axis] < one.high[axis])) return LAM_OK;
    if (array_grow(&all->items, &all->capacity, all->n + 1, sizeof *all->items, "blocks", error) != LAM_OK)
        return LAM_ERR_MEMORY;
    all->items[all->n++] = one;
    return LAM_OK;
}

void blocks_free(blocks *all) {
    free(all->items);
    *all = (blocks){0};
}

/* Space cut along every side of every box: the filling of each cell, and the places of the cuts. */
typedef struct raster {
    size_t n[3]; /* cells along each axis */
    double *at[3];
    uint8_t *fill;
    uint8_t *mask; /* of one plane: 1 + the group of a face that is still to be made, or 0 */
} raster;

static int by_place(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static lam_status make_cuts(raster *r, const blocks *all, int axis, lam_error *error) {
    double *at = memory_allocate(2 * all->n, sizeof *at, "blocks", error);
    if (at == NULL) return LAM_ERR_MEMORY;
    for (size_t b = 0; b < all->n; b++) {
        assert(all->items[b].low[axis] >= all->items[0].low[axis]);
        assert(all->items[b].high[axis] <= all->items[0].high[axis]);
        at[2 * b] = all->items[b].low[axis];
        at[2 * b + 1] = all->items[b].high[axis];
    }
    qsort(at, 2 * all->n, sizeof *at, by_place);
    size_t n = 1;
    for (size_t i = 1; i < 2 * all->n; i++)
        if (at[i] != at[n - 1]) at[n++] = at[i];
    r->at[axis] = at;
    r->n[axis] = n - 1;
    return LAM_OK;
}

static size_t cut_at(const raster *r, int axis, double place) {
    const double *found = bsearch(&place, r->at[axis], r->n[axis] + 1, sizeof place, by_place);
    return (size_t)(found - r->at[axis]);
}

static size_t cell_of(const raster *r, const size_t at[3]) {
    return (at[2] * r->n[1] + at[1]) * r->n[0] + at[0];
}

static lam_status raster_make(raster *r, const blocks *all, lam_error *error) {
    lam_status status = LAM_OK;
    size_t plane = 0;
    for (int axis = 0; axis < 3; axis++) TRY(make_cuts(r, all, axis, error));
    for (int axis = 0; axis < 3; axis++) {
        const size_t cells = r->n[axis] * r->n[(axis + 1) % 3];
        plane = cells > plane ? cells : plane;
    }
    r->fill = memory_allocate(r->n[0] * r->n[1], r->n[2], "blocks", error);
    r->mask = memory_allocate(plane, 1, "blocks", error);
    if (r->fill == NULL || r->mask == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t b = 0; b < all->n; b++) {
        size_t low[3], high[3], at[3];
        for (int axis = 0; axis < 3; axis++) {
            low[axis] = cut_at(r, axis, all->items[b].low[axis]);
            high[axis] = cut_at(r, axis, all->items[b].high[axis]);
        }
        for (at[2] = low[2]; at[2] < high[2]; at[2]++)
            for (at[1] = low[1]; at[1] < high[1]; at[1]++)
                for (at[0] = low[0]; at[0] < high[0]; at[0]++)
                    r->fill[cell_of(r, at)] = (uint8_t)all->items[b].fill;
    }
done:
    return status;
}

static void raster_free(raster *r) {
    for (int axis = 0; axis < 3; axis++) free(r->at[axis]);
    free(r->fill);
    free(r->mask);
}

/* The faces of solids at one cut across an axis, for the solids on one side of it. */
static void mark_plane(raster *r, const block_stuff *stuffs, int axis, size_t cut, bool behind) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    size_t at[3];
    for (at[v] = 0; at[v] < r->n[v]; at[v]++)
        for (at[u] = 0; at[u] < r->n[u]; at[u]++) {
            at[axis] = cut - 1;
            const int before = r->fill[cell_of(r, at)];
            at[axis] = cut;
            const int after = r->fill[cell_of(r, at)], solid = behind ? after : before;
            uint8_t *mark = &r->mask[at[v] * r->n[u] + at[u]];
            *mark = 0;
            if (solid < BLOCK_SOLID || (behind ? before : after) != BLOCK_AIR) continue;
            const block_stuff *stuff = &stuffs[solid - BLOCK_SOLID];
            *mark = (uint8_t)(1 + (axis < 2 ? stuff->side : behind ? stuff->under : stuff->top));
        }
}

/* Cells of a plane: n[0] from at[0] on along u, n[1] from at[1] on along v. */
typedef struct region {
    size_t at[2], n[2];
} region;

static bool is_marked(const raster *r, size_t n_u, const region *g, uint8_t mark) {
    for (size_t j = 0; j < g->n[1]; j++)
        for (size_t i = 0; i < g->n[0]; i++)
            if (r->mask[(g->at[1] + j) * n_u + g->at[0] + i] != mark) return false;
    return true;
}

/* Grows a region of one group from a cell: as far as possible along one axis of the plane, then along the
 * other. */
static region grow_region(const raster *r, const size_t n[2], const size_t at[2], int first, uint8_t mark) {
    region g = {{at[0], at[1]}, {1, 1}};
    for (int turn = 0; turn < 2; turn++) {
        const int k = turn == 0 ? first : 1 - first;
        for (region next = {{at[0], at[1]}, {1, 1}}; g.at[k] + g.n[k] < n[k]; g.n[k]++) {
            next.at[k] = g.at[k] + g.n[k];
            next.n[1 - k] = g.n[1 - k];
            if (!is_marked(r, n[0], &next, mark)) break;
        }
    }
    return g;
}

static lam_status plane_patches(raster *r, int axis, size_t cut, bool behind, patch_list *out,
                                lam_error *error) {
    lam_status status = LAM_OK;
    const int along[2] = {(axis + 1) % 3, (axis + 2) % 3};
    const size_t n[2] = {r->n[along[0]], r->n[along[1]]};
    size_t at[2];
    for (at[1] = 0; at[1] < n[1]; at[1]++)
        for (at[0] = 0; at[0] < n[0]; at[0]++) {
            const uint8_t mark = r->mask[at[1] * n[0] + at[0]];
            double area[2], corners[4][3];
            region both[2];
            if (mark == 0) continue;
            for (int k = 0; k < 2; k++) {
                both[k] = grow_region(r, n, at, k, mark);
                area[k] = 1;
                for (int c = 0; c < 2; c++)
                    area[k] *= r->at[along[c]][at[c] + both[k].n[c]] - r->at[along[c]][at[c]];
            }
            const region *best = &both[area[1] > area[0]];
            for (size_t j = 0; j < best->n[1]; j++)
                memset(&r->mask[(at[1] + j) * n[0] + at[0]], 0, best->n[0]);
            for (int k = 0; k < 4; k++) { /* faces of blocks behind the cut face backwards along the axis */
                const int corner = behind ? 3 - k : k;
                const bool far[2] = {corner == 1 || corner == 2, corner >= 2};
                corners[k][axis] = r->at[axis][cut];
                for (int c = 0; c < 2; c++)
                    corners[k][along[c]] = r->at[along[c]][at[c] + (far[c] ? best->n[c] : 0)];
            }
            TRY(patch_add(out, (const double(*)[3])corners, 4, mark - 1u, error));
        }
done:
    return status;
}

lam_status blocks_patches(const blocks *all, const block_stuff *stuffs, patch_list *out, lam_error *error) {
    lam_status status = LAM_OK;
    raster r = {0};
    TRY(raster_make(&r, all, error));
    for (int axis = 0; axis < 3; axis++)
        for (size_t cut = 1; cut < r.n[axis]; cut++)
            for (int behind = 0; behind < 2; behind++) {
                mark_plane(&r, stuffs, axis, cut, behind);
                TRY(plane_patches(&r, axis, cut, behind, out, error));
            }
done:
    raster_free(&r);
    return status;
}
