/* The luminaires of a scene as eyes see them, for ratings of their glare. */
#ifndef LAMBERT_SENSOR_EYE_LUMINAIRES_H
#define LAMBERT_SENSOR_EYE_LUMINAIRES_H

#include "solver/direct/direct_points.h"
#include "solver/figures/glare.h"
#include "solver/sensor/sensors.h"

/* The eyes of a list: their places among its receivers, ascending, *out freed with free(). Errors:
 * LAM_ERR_MEMORY. */
lam_status eyes_find(const sensor_list *l, size_t *n_eyes, uint32_t **out, lam_error *error);

/* seen [luminaires that are wanted][n_eyes]: how each of these receivers, planes that face the way they look,
 * sees each luminaire at dim 1, without colour. Intensity, area and distance are those of the middle of the
 * opening, as CIE 117 has them; the part that is seen is by segments to all of it, as in direct light. An eye
 * on a face is taken off it as in sensor_rows_make. Errors and cost: as direct_points_visit. */
lam_status eye_luminaires_make(const mesh *m, const placed_luminaires *p, const direct_options *o,
                               const receiver *receivers, size_t n_eyes, const uint32_t *eyes,
                               glare_source *seen, lam_error *error);

#endif
