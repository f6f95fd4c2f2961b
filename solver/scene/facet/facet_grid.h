/* Finds the element of a facet at a point, by a grid aligned with the facet's elements. Knows no light. */
#ifndef LAMBERT_SCENE_FACET_FACET_GRID_H
#define LAMBERT_SCENE_FACET_FACET_GRID_H

#include "solver/scene/facet/facets.h"

/* The map from a piece to its facet's grid: x = x[0] + u x[1] + v x[2], y likewise, with the barycentric
 * coordinates u and v of its second and last corner. */
typedef struct piece_place {
    float x[3], y[3];
    float most[2];            /* the largest numbers below those of the grid's columns and rows */
    uint32_t grid, nx, first; /* the last two as the grid has them, so that a search reads one place */
} piece_place;

typedef struct facet_grid facet_grid;

typedef struct facet_grids {
    piece_place *pieces; /* [n_pieces]; unused where a facet is one element */
    facet_grid *grids;
    size_t n_grids;
    uint32_t *cells;
    struct facet_candidate *candidates;
    size_t n_cells, n_candidates, cell_capacity, candidate_capacity;
} facet_grids;

/* Freed by facet_grids_free. Cost: O(n). Errors: LAM_ERR_MEMORY. */
lam_status facet_grids_create(const mesh *m, const facets *f, facet_grids *out, lam_error *error);
void facet_grids_free(facet_grids *g);

/* The most points of one facet_grids_find. */
#define FACET_SEARCHES 136

/* element[i], i < n: the element at (u, v) of a piece, always one of its facet, which must have more than
 * one. A point within about 1e-5 of an element's width from its border may be assigned to the neighbour.
 * Cost: O(1) each, two or three cache lines. */
void facet_grids_find(const facet_grids *g, size_t n, const uint32_t *piece, const float *u, const float *v,
                      uint32_t *element);

#endif
