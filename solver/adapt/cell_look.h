/* The light on a cell, and the error that a constant leaves there. Must not know which cells are cut. */
#ifndef LAMBERT_ADAPT_CELL_LOOK_H
#define LAMBERT_ADAPT_CELL_LOOK_H

#include "solver/adapt/cell_points.h"
#include "solver/adapt/coarse_light.h"
#include "solver/scene/mesh_cells.h"

/* The scene and its lights, the same for all cells. */
typedef struct cell_light {
    const mesh *m; /* faces; both sides are looked at of those that are to have a back */
    const coarse_light *coarse;
    const gather *g;
    double all[COARSE_LIGHTS]; /* sum A |B - E|^2, above 0 */
} cell_light;

/* Values of a point: lights and channels, of the front and then, where the mesh has faces with two sides, of
 * the back, 0 on faces without one. */
size_t cell_light_values(const cell_light *light);

/* Adds steps x steps points of a cell with rho H, which fit; error, by light: A |rho (H - mean)|^2 over
 * |B - E|^2 by these points alone, from products of independent halves, without noise on average. The key
 * chooses all samples. Cost: that of gather_at, on each side. */
enum { CELL_STEPS_MOST = 16 };
void cell_look_at(const cell_light *light, const mesh_cell *c, uint64_t key, size_t steps,
                  cell_points *points, float error[COARSE_LIGHTS]);

#endif
