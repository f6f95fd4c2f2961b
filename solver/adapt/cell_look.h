/* The light on a cell: the error that a constant leaves there, and the gain of each straight cut (Radha et
 * al. 1996 divide images likewise, by binary space partitions). Must not know which cells are cut. */
#ifndef LAMBERT_ADAPT_CELL_LOOK_H
#define LAMBERT_ADAPT_CELL_LOOK_H

#include "solver/adapt/coarse_light.h"
#include "solver/adapt/gather.h"
#include "solver/scene/mesh_cells.h"

/* The scene and its lights, the same for all cells. */
typedef struct cell_light {
    const mesh *m; /* faces */
    const coarse_light *coarse;
    const gather *g;
    double all[COARSE_LIGHTS]; /* sum A |B - E|^2, above 0 */
    bool two_sided;            /* both sides of a cell are looked at */
} cell_light;

/* Squares of errors, A |rho (H - mean)|^2 over |B - E|^2, by light, from products of independent halves:
 * without noise on average. */
typedef struct cell_look {
    float error[COARSE_LIGHTS];
    uint16_t n_cuts; /* no part of these cuts is too long and narrow */
    struct {
        mesh_cut cut;
        float gain[COARSE_LIGHTS]; /* the square without the cut less that with it */
    } of[MESH_CUTS_MOST];
} cell_look;

/* The samples of a cell. Cost: 128 rays and at most 256 segments from each of CELL_POINTS points, on each
 * side; the key chooses all of them. */
enum { CELL_STEPS = 6, CELL_POINTS = CELL_STEPS * CELL_STEPS };
void cell_look_at(const cell_light *light, const mesh_cell *c, uint64_t key, cell_look *out);

#endif
