/* The values that elements show, as they are or smoothed within a surface. */
#ifndef LAMBERT_RENDER_SHADE_H
#define LAMBERT_RENDER_SHADE_H

#include "solver/scene/mesh.h"

typedef struct shade shade;

#define SHADE_MAX_CHANNELS 3

/* What element i shows in channel c is values[c * n + i]; only the first SHADE_MAX_CHANNELS are kept.
 * smooth averages at the vertices of a surface: elements of one group that meet at less than 20 degrees.
 * A vertex inside another element's edge takes that edge's value, so that none of the edges shows a crack.
 * The mesh must outlive it. Errors: LAM_ERR_MEMORY. */
lam_status shade_create(const mesh *m, size_t n_channels, const float *values, bool smooth, shade **out,
                        lam_error *error);
void shade_destroy(shade *s);

size_t shade_channels(const shade *s);

/* The values [C] at a point (scene coordinates) of an element; away from its plane, at the nearest of it. */
void shade_at(const shade *s, uint32_t element, const double point[3], float *values);

#endif
