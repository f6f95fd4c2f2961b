/* The direct light of placed luminaires at points of a scene, as beams: any weight of directions can be
 * summed over them. */
#ifndef LAMBERT_DIRECT_DIRECT_POINTS_H
#define LAMBERT_DIRECT_DIRECT_POINTS_H

#include "solver/direct/direct_elements.h"

/* The element of a point that lies on none. */
#define DIRECT_OPEN SIZE_MAX

/* element: the one that it lies on, whose plane hides nothing from it. */
typedef struct direct_point {
    double at[3];
    size_t element;
} direct_point;

/* The light of a cell of an opening. direction: the unit vector from the point towards it, in the scene;
 * irradiance: I V / d^2, lx at dim 1, across that direction; passed: V, 1 or what panes pass. */
typedef struct direct_beam {
    double direction[3], irradiance, passed;
} direct_beam;

/* Is given the beams of a luminaire that reach a point, of which there may be none; row: of the luminaire
 * among those that are wanted. Called by several threads at once, for different points. */
typedef void direct_beam_visitor(void *context, size_t row, size_t point, size_t n, const direct_beam *beams);

/* Visits each luminaire that is wanted and each point. Of an opening that is partly hidden from a point there
 * are 256 beams or more, else at least 16. o->segments and o->seed do not matter. Errors: as
 * direct_light_make. Cost: 16 segments for a luminaire and a point. */
lam_status direct_points_visit(const mesh *m, const placed_luminaires *p, const direct_options *o, size_t n,
                               const direct_point *points, direct_beam_visitor *visit, void *context,
                               lam_error *error);

/* E [n_luminaires that are wanted][n]: the irradiance of points with unit normals, sum over beams of
 * irradiance max(0, normal . direction), lx at dim 1. */
lam_status direct_points_irradiance(const mesh *m, const placed_luminaires *p, const direct_options *o,
                                    size_t n, const direct_point *points, const double (*normals)[3],
                                    float *E, lam_error *error);

#endif
