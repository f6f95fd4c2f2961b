/* Points by cubic cells, to find those near a place. */
#ifndef LAMBERT_OPERATOR_CORNERS_POINT_GRID_H
#define LAMBERT_OPERATOR_CORNERS_POINT_GRID_H

#include "store/status.h"

#include <stdint.h>

/* Cells are hashed; each is a chain. The points are borrowed. */
typedef struct point_grid {
    double cell;    /* m */
    size_t n_heads; /* a power of 2 */
    uint32_t *heads, *next;
    const double (*points)[3];
} point_grid;

/* For up to n points, none of which is in it yet. Freed by point_grid_free, also after an error. Errors:
 * LAM_ERR_MEMORY. */
lam_status point_grid_create(const double (*points)[3], size_t n, double cell, point_grid *g,
                             lam_error *error);
void point_grid_free(point_grid *g);

void point_grid_add(point_grid *g, uint32_t i);

/* Visits the points in the 27 cells around a place, and others with the same hash. */
void point_grid_near(const point_grid *g, const double place[3], void (*visit)(void *context, uint32_t i),
                     void *context);

#endif
