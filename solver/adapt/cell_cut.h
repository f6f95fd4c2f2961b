/* The straight cut of a cell that takes most off the error of constants (Radha et al. 1996 divide images
 * likewise, by binary space partitions). Must not know which cells are cut. */
#ifndef LAMBERT_ADAPT_CELL_CUT_H
#define LAMBERT_ADAPT_CELL_CUT_H

#include "solver/adapt/cell_look.h"

typedef struct cell_cut {
    mesh_cut cut;
    float gain[COARSE_LIGHTS]; /* by light: the square of the error less that with the cut */
} cell_cut;

/* best[l]: the cut that gains most of light l, of those whose parts are not too long and narrow; its own gain
 * is 0 where none gains. All cuts between eighths of edges are tried, then those between sixteenths near the
 * best. Cost: about 170 times the points. */
enum { CELL_POINTS_MOST = 512 };
void cell_cut_find(const cell_light *light, const mesh_cell *c, const cell_points *points,
                   cell_cut best[COARSE_LIGHTS]);

/* The places of a cut in the plane of its face; the first part of the cell is to the right of the way. */
void cell_cut_way(const cell_light *light, const mesh_cell *c, mesh_cut cut, float from[2], float to[2]);

#endif
