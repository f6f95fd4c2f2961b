/* A set of probes over the free space of a scene: of a lattice over all of it, those points that lie in no
 * wall and not outside of it. */
#ifndef LAMBERT_SENSOR_PROBE_GRID_H
#define LAMBERT_SENSOR_PROBE_GRID_H

#include "solver/sensor/sensors.h"

typedef struct probe_grid {
    double spacing; /* m */
    bool y_up;      /* axes of glTF, three.js and Godot, in place of those of the scene */
} probe_grid;

/* The name of the set. */
#define PROBE_GRID_NAME "probes"

/* Adds the set to a list, in place of its set of probes of that name where it has one; x runs fastest, then
 * y. Of the 64 rays of a point that is left out, most of those that meet faces meet backs. The lattice has
 * this spacing, and its middle is that of the scene. n_out: how many points are left out. Errors:
 * LAM_ERR_ARGUMENT (too many points, none is free, other sensors have the name), LAM_ERR_MEMORY,
 * LAM_ERR_INTERNAL. Cost: 64 rays for a point. */
lam_status probe_grid_add(const mesh *m, const probe_grid *grid, sensor_list *list, size_t *n_out,
                          lam_error *error);

#endif
