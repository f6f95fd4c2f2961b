#include "solver/operator/corners/point_grid.h"

#include <math.h>
#include <stdlib.h>

#define NONE 0xFFFFFFFFu

static int64_t cell_of(const point_grid *g, double x) {
    return (int64_t)floor(fmin(fmax(x / g->cell, -4e18), 4e18));
}

static size_t hash_of(const point_grid *g, const int64_t cell[3]) {
    uint64_t h = 0;
    for (int d = 0; d < 3; d++) {
        h = (h ^ (uint64_t)cell[d]) * 0x9E3779B97F4A7C15u;
        h ^= h >> 29;
    }
    return (size_t)h & (g->n_heads - 1);
}

lam_status point_grid_create(const double (*points)[3], size_t n, double cell, point_grid *g,
                             lam_error *error) {
    *g = (point_grid){.cell = cell, .n_heads = 16, .points = points};
    while (g->n_heads < n) g->n_heads *= 2;
    g->heads = memory_allocate(g->n_heads, sizeof *g->heads, "corners", error);
    g->next = memory_allocate(n, sizeof *g->next, "corners", error);
    if (g->heads == NULL || g->next == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < g->n_heads; i++) g->heads[i] = NONE;
    return LAM_OK;
}

void point_grid_free(point_grid *g) {
    free(g->heads);
    free(g->next);
    *g = (point_grid){.cell = 0};
}

void point_grid_add(point_grid *g, uint32_t i) {
    const double *p = g->points[i];
    const int64_t cell[3] = {cell_of(g, p[0]), cell_of(g, p[1]), cell_of(g, p[2])};
    const size_t head = hash_of(g, cell);
    g->next[i] = g->heads[head];
    g->heads[head] = i;
}

void point_grid_near(const point_grid *g, const double place[3], void (*visit)(void *context, uint32_t i),
                     void *context) {
    int64_t centre[3];
    for (int d = 0; d < 3; d++) centre[d] = cell_of(g, place[d]);
    for (int k = 0; k < 27; k++) {
        const int64_t cell[3] = {centre[0] + k % 3 - 1, centre[1] + k / 3 % 3 - 1, centre[2] + k / 9 - 1};
        for (uint32_t i = g->heads[hash_of(g, cell)]; i != NONE; i = g->next[i]) visit(context, i);
    }
}
