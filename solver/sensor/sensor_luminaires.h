/* The direct light of luminaires at receivers: sums over beams of irradiance times the weight of each. */
#ifndef LAMBERT_SENSOR_SENSOR_LUMINAIRES_H
#define LAMBERT_SENSOR_SENSOR_LUMINAIRES_H

#include "solver/direct/direct_points.h"
#include "solver/sensor/receiver.h"

/* H [luminaires that are wanted][n], lx at dim 1 without colour, as of elements; inside [n], or NULL, is set
 * for receivers in the box about the opening of any luminaire of the list, where no number is true, and left
 * alone for others. Receivers on faces are taken off them as in sensor_rows_make. Errors and cost: as
 * direct_points_visit. */
lam_status sensor_luminaires_make(const mesh *m, const placed_luminaires *p, const direct_options *o,
                                  size_t n, const receiver *receivers, float *H, bool *inside,
                                  lam_error *error);

#endif
