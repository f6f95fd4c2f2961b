/* Points in the cells of a grid: those near another point or near a segment. Private to face_edges.c. */
#ifndef LAMBERT_SCENE_FACET_PLACE_GRID_H
#define LAMBERT_SCENE_FACET_PLACE_GRID_H

#include "store/status.h"

#include <stdint.h>

typedef struct place_grid {
    double low[3], cell;
    size_t count[3];
    size_t *first; /* [cells + 1] */
    uint32_t *items;
} place_grid;

/* The points v < n with keep[v] == v, in about as many cells as there are points on a surface. points must
 * outlive the grid. Errors: LAM_ERR_MEMORY. */
lam_status place_grid_create(size_t n, const double (*points)[3], const uint32_t *keep, place_grid *out,
                             lam_error *error);
void place_grid_free(place_grid *g);

/* Calls visit for each point of the cells within slack of the segment from p to q, at least those nearer than
 * slack to it, once each. Returns the first status that is not LAM_OK. */
typedef lam_status place_visit(void *context, uint32_t point, lam_error *error);
lam_status place_grid_along(const place_grid *g, const double p[3], const double q[3], double slack,
                            place_visit *visit, void *context, lam_error *error);

#endif
