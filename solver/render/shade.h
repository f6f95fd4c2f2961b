/* The values drawn at points of elements: constant on each element, or smoothed within a surface. */
#ifndef LAMBERT_RENDER_SHADE_H
#define LAMBERT_RENDER_SHADE_H

#include "solver/scene/mesh.h"

typedef struct shade shade;

#define SHADE_MAX_CHANNELS 3

/* values[c * n + i] is the value of element i in channel c; only the first SHADE_MAX_CHANNELS are kept.
 * smooth: inside elements as smooth_corners says, with E its part that does not vary there, or NULL. The mesh
 * must outlive it. Errors: LAM_ERR_MEMORY. */
lam_status shade_create(const mesh *m, size_t n_channels, const float *values, const float *E, bool smooth,
                        shade **out, lam_error *error);
void shade_destroy(shade *s);

size_t shade_channels(const shade *s);

/* The values [C] at a point of an element, in scene coordinates; at its projection where it is off the plane.
 */
void shade_at(const shade *s, uint32_t element, const double point[3], float *values);

#endif
