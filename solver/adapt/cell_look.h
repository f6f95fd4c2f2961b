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

/* Estimated errors of constants on elements, of the lights that there are. */
typedef struct mesh_estimate {
    bool has_lamps, has_groups, has_sky;
    /* They are of the light of lamps, the largest of those of single groups, of 1 from every element, and of
     * an even sky. */
    double lamps, groups, even, sky;
} mesh_estimate;

/* The estimate by sums of squares of each light; mesh_estimate_most is the largest error. */
mesh_estimate mesh_estimate_of(const coarse_light *c, const double sum[COARSE_LIGHTS]);
double mesh_estimate_most(const mesh_estimate *e);

/* A cell_light with what it views, where it is made: it must not be moved. Faces outlive it. Errors: those of
 * coarse_light_make. */
typedef struct light_scene {
    coarse_light coarse;
    gather_sky sky;
    gather *g;
    cell_light light;
} light_scene;
lam_status light_scene_make(const mesh *faces, const coarse_sources *from, uint64_t seed, const progress *p,
                            light_scene *out, lam_error *error);
void light_scene_free(light_scene *s);

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
